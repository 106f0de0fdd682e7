"""Switches an output, reads inputs, holds the queue until an input changes, and runs a conveyor belt.

    python io_and_conveyor.py [serial:///dev/ttyUSB0 | udp://192.168.1.20 | ...]

On a real arm: nothing of the arm moves, but what is plugged in does. A belt on stepper 1 runs about 10 mm forwards and
10 mm back. Which pin is on which socket, and what it may drive, is in the user guide: set the three numbers below to
pins where it does no harm.
"""

from __future__ import annotations

import asyncio
import os
import sys

from dobot_async import IOFunction, Magician

URL = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("DOBOT_URL", "sim:?speed=20")
LAMP, SWITCH, KNOB = 2, 4, 5
BELT, MM = 1, 160  # the stepper, and its pulses in a millimetre of the vendor's belt


async def main() -> None:
    """Tries each of them once."""
    async with Magician.connect(URL) as arm:
        await arm.configure_io(LAMP, IOFunction.DO)
        await arm.configure_io(SWITCH, IOFunction.DI)
        await arm.configure_io(KNOB, IOFunction.ADC)

        for level in (True, False):
            await arm.set_output(LAMP, level)
            print(f"lamp   {'on' if await arm.get_output(LAMP) else 'off'}")

        pressed = await arm.get_input(SWITCH)
        print(f"switch {'high' if pressed else 'low'}")
        print(f"knob   {await arm.get_adc(KNOB)} of 4095")

        # In the queue, the arm itself waits for the switch, switches the lamp and runs the belt, in this order.
        async with arm.queue.batch() as batch:
            batch.wait_for_input(SWITCH, level=pressed)
            batch.set_output(LAMP, True)
            batch.conveyor(50 * MM, distance=10 * MM, motor=BELT)
            batch.conveyor(-50 * MM, distance=10 * MM, motor=BELT)
            last = batch.set_output(LAMP, False)

        await last
        print(f"belt   done, lamp {'on' if await arm.get_output(LAMP) else 'off'}")


asyncio.run(main())

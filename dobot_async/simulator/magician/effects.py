"""What each command of the Magician does when its turn comes: the table from rows to Activities.

A row that is not in the table sets its register and takes no time.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.simulator.device.device import Device
from dobot_async.simulator.device.work import Activity, DeviceFault, Executed, Work
from dobot_async.simulator.magician.jog import jog, margins
from dobot_async.simulator.magician.motion import Motions
from dobot_async.simulator.magician.state import State

__all__ = ["CommandEffects", "read_pin"]

LEVELLING = 5.0  # seconds
LIMITS = frozenset(range(0x40, 0x4A))
LOSE_STEP = 0x50
INVALID = 0x6C
AT_LIMIT = 0.1  # degrees; nearer to a limit than this, its alarm stays


class CommandEffects:
    """Makes the works of one arm.

    Attributes:
        motions: The motions alone.
    """

    def __init__(self, state: State) -> None:
        self.motions: Motions = Motions(state)
        self._state = state
        self._jogging: c.JOGCmd | None = None

    def make(self, row: Command[Any, Any], value: Any) -> Work:
        """Returns the work of a command; a queued jog takes no place in time, as its key only goes down or up."""
        return Work(row.name, partial(self._begin, row, value), row.moves and row is not c.SET_JOG_CMD, row, value)

    def jog(self, value: c.JOGCmd, device: Device) -> None:
        """Presses or releases a key; the same key again changes nothing, and while the arm executes none is heard."""
        if value == self._jogging:
            return

        device.end_aside()
        if value.cmd is not c.JOGKey.IDLE:
            self._jogging = value
            work = Work(
                c.SET_JOG_CMD.name, partial(self._begin_jog, value), moves=True, command=c.SET_JOG_CMD, value=value
            )
            if not device.begin_aside(work):
                self._jogging = None

    def finished(self, executed: Executed, device: Device) -> None:
        """To be told of each command that has finished, however it did."""
        if executed.command is c.SET_JOG_CMD and executed.index is None:
            self._jogging = None
        elif executed.command is c.SET_E_MOTOR_S:
            motor: int = executed.value.index
            self._state.motors[motor].run(0)

        if executed.command and executed.command.moves and executed.outcome != "alarm":
            self._leave_limits(device)

    def _begin(self, row: Command[Any, Any], value: Any, device: Device) -> Activity | None:
        plan = PLANS.get(row)
        if plan:
            return plan(self, value, device)

        self._state.set(row, value)
        return None

    def _begin_jog(self, value: c.JOGCmd, device: Device) -> Activity:
        return jog(self._state, self.motions.reach, value, device.joints)

    def _leave_limits(self, device: Device) -> None:
        """Clears the alarms of limits that the arm has left."""
        if device.alarms & LIMITS:
            left = margins(self._state.limits, device.joints).items()
            device.clear_alarms(code for code, margin in left if margin > AT_LIMIT)

    # The rows.

    def wait(self, value: c.WAITCmd, _: Device) -> Activity:
        """Milliseconds."""
        return Activity(value.timeout / 1000)

    def trigger(self, value: c.TRIGCmd, device: Device) -> Activity:
        """Until an input meets the condition."""
        compare = CONDITIONS.get((value.mode, value.condition))
        if compare is None:
            raise DeviceFault(INVALID)

        state, mode, address = self._state, value.mode, value.address
        return Activity(None, ready=lambda: compare(read_pin(state, device, mode, address), value.threshold))

    def level(self, value: c.AutoLevelingCmd, _: Device) -> Activity:
        """Levelling, as far as a simulation can."""

        def end() -> None:
            self._state.levelled = value.precision

        return Activity(LEVELLING, end=end) if value.control_flag else Activity()

    def check_steps(self, _: None, device: Device) -> None:
        """Looks for lost steps."""
        threshold = self._state.get(c.SET_LOST_STEP_PARAMS)
        lost = [LOSE_STEP + joint for joint, steps in enumerate(self._state.lost_steps) if abs(steps) > threshold]
        for code in lost[1:]:
            device.raise_alarm(code)

        if lost:
            raise DeviceFault(lost[0])

    def run_motor(self, value: c.EMotor, _: Device) -> None:
        """Until told otherwise."""
        self._state.motors[value.index].run(value.speed if value.is_enabled else 0)

    def turn_motor(self, value: c.EMotorS, _: Device) -> Activity:
        """For a number of pulses; `finished` stops it."""
        if not (value.is_enabled and value.speed):
            return Activity()

        self._state.motors[value.index].run(value.speed)
        return Activity(value.distance / abs(value.speed))


def read_pin(state: State, device: Device, mode: c.TriggerMode, address: int) -> float:
    """What a pin reads: 0 unless it is configured for that, and high if nothing but a pull-up is at it."""
    function = state.function(address)
    if function not in INPUTS[mode]:
        return 0.0

    return device.get_input((mode, address), float(function is c.IOFunction.DIPU))


INPUTS: Mapping[c.TriggerMode, frozenset[c.IOFunction]] = {
    c.TriggerMode.IO: frozenset({c.IOFunction.DI, c.IOFunction.DIPU, c.IOFunction.DIPD}),
    c.TriggerMode.ADC: frozenset({c.IOFunction.ADC}),
}
"""The functions with which a pin can be read."""

Plan = Callable[[CommandEffects, Any, Device], Activity | None]

CONDITIONS: Mapping[tuple[c.TriggerMode, int], Callable[[float, float], bool]] = {
    (c.TriggerMode.IO, c.TriggerIOCondition.EQUAL): operator.eq,
    (c.TriggerMode.IO, c.TriggerIOCondition.NOT_EQUAL): operator.ne,
    (c.TriggerMode.ADC, c.TriggerADCCondition.LESS): operator.lt,
    (c.TriggerMode.ADC, c.TriggerADCCondition.LESS_OR_EQUAL): operator.le,
    (c.TriggerMode.ADC, c.TriggerADCCondition.GREATER_OR_EQUAL): operator.ge,
    (c.TriggerMode.ADC, c.TriggerADCCondition.GREATER): operator.gt,
}

PLANS: Mapping[Command[Any, Any], Plan] = {
    c.SET_HOME_CMD: lambda works, _, device: works.motions.home(device),
    c.SET_AUTO_LEVELING_CMD: CommandEffects.level,
    c.SET_JOG_CMD: CommandEffects.jog,
    c.SET_WAIT_CMD: CommandEffects.wait,
    c.SET_TRIG_CMD: CommandEffects.trigger,
    c.SET_E_MOTOR: CommandEffects.run_motor,
    c.SET_E_MOTOR_S: CommandEffects.turn_motor,
    c.SET_LOST_STEP_CMD: CommandEffects.check_steps,
    c.SET_CP_CMD: lambda works, value, device: works.motions.cp(value, device),
    c.SET_CPLE_CMD: lambda works, value, device: works.motions.cp(value, device),
    c.SET_ARC_CMD: lambda works, value, device: works.motions.arc(value, device),
    c.SET_CIRCLE_CMD: lambda works, value, device: works.motions.circle(value, device),
    **dict.fromkeys(
        (c.SET_PTP_CMD, c.SET_PTP_WITH_L_CMD, c.SET_PTPPO_CMD, c.SET_PTPPO_WITH_L_CMD),
        lambda works, value, device: works.motions.ptp(value, device),
    ),
}
"""What takes time, moves, or is more than a register."""

"""Motions as spans: what the exporter got, beside what the arm has executed."""

from __future__ import annotations

import sys
from typing import Any

import pytest
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from opentelemetry.trace import StatusCode
from virtual import virtual

from dobot_async import ArmAlarm, Magician, MotionStopped, MyCobot, UltraArm
from dobot_async.simulator import simulate
from dobot_async.spans import motion_spans


def exported() -> tuple[TracerProvider, InMemorySpanExporter]:
    exporter, provider = InMemorySpanExporter(), TracerProvider()
    provider.add_span_processor(SimpleSpanProcessor(exporter))
    return provider, exporter


@virtual
async def test_each_motion_is_a_span_under_the_one_that_is_current() -> None:
    provider, exporter = exported()
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        await arm.move_to(200, 0, 40)
        with motion_spans(arm, name="left", provider=provider):
            with provider.get_tracer("mine").start_as_current_span("a part") as part:
                await arm.move_to(220, 0, 40)
                async with arm.queue.batch() as batch:
                    batch.suction(True)
                    last = batch.move_to(220, 0, 60)

                await last

            with pytest.raises(ArmAlarm):
                await arm.move_to(900, 0, 0)

            await arm.recover()
            stopped = await arm.queue.move_to(220, 100, 40)
            await arm.stop()
            with pytest.raises(MotionStopped):
                await stopped

        await arm.recover()
        await arm.move_to(200, 0, 40)

    assert len([each for each in sim.arm.executed if each.name == "SetPTPCmd" and each.outcome == "done"]) == 4
    spans = [each for each in exporter.get_finished_spans() if each.name != "a part"]
    assert [(each.name, each.status.status_code, each.status.description) for each in spans] == [
        ("SetPTPCmd", StatusCode.OK, None),
        ("SetEndEffectorSuctionCup", StatusCode.OK, None),
        ("SetPTPCmd", StatusCode.OK, None),
        ("SetPTPCmd", StatusCode.ERROR, "ArmAlarm"),
        ("SetPTPCmd", StatusCode.ERROR, "MotionStopped"),
    ]
    parents = [each.parent.span_id if each.parent else None for each in spans]
    assert parents == [part.get_span_context().span_id] * 3 + [None] * 2
    for each in spans:
        given: Any = each.attributes
        assert given["dobot.arm"] == "left"
        assert given["dobot.index"] > 0
        assert each.start_time
        assert each.end_time
        assert each.start_time <= each.end_time

    assert [event.name for event in spans[3].events] == ["exception"]


@virtual
async def test_the_other_families_and_what_has_not_ended() -> None:
    for kind, model in ((MyCobot, "mycobot280"), (UltraArm, "ultraarm")):
        provider, exporter = exported()
        family: Any = kind
        async with simulate(model) as sim, family.connect(sim.url) as arm:
            await (arm.power_on() if kind is MyCobot else arm.home())
            with motion_spans(arm, provider=provider):
                await arm.move_joints(*(10.0,) * len(await arm.get_joints()))
                motion = await arm.queue.move_joints(*(30.0,) * len(await arm.get_joints()))

            await motion

        first, second = exporter.get_finished_spans()
        assert first.status.status_code is StatusCode.OK
        assert second.status.status_code is StatusCode.UNSET


async def test_a_library_that_is_missing_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "opentelemetry", None)
    async with Magician.connect("sim:") as arm:
        with pytest.raises(ImportError, match=r"dobot-async\[otel\]"), motion_spans(arm):
            pass

        assert not arm.queue.on_motion

"""Decoder of entries: messages to what a watcher of the run was told, by the name of their schema; None for what only viewers draw."""

import json
from collections.abc import Callable

from oio.core.records import Event
from oio.log import decode, schemas
from oio.log.arm_scene import arm_frames, setup
from oio.log.entries import BeliefScene, BelievedNose, Entry, Progress, Setup, StageMark
from oio.log.scene import belief_scene


def _event(t_ns: int, data: bytes) -> Event | Progress:
    message = schemas.Event.FromString(data)
    parts = message.text.split(": ", 2)
    if message.kind == "progress" and len(parts) == 3:
        return Progress(t_ns, *parts)
    return Event(t_ns, message.kind, message.text)


def _stage(t_ns: int, data: bytes) -> StageMark:
    message = schemas.StageResult.FromString(data)
    why = json.loads(message.json)["text"] if message.state == "failed" else ""
    return StageMark(t_ns, message.stage, message.state, why)


def _scene(t_ns: int, data: bytes) -> BeliefScene | Setup | None:
    return belief_scene(t_ns, data) or setup(data)


ENTRIES: dict[str, Callable[[int, bytes], Entry | None]] = {
    **decode.SAMPLES,
    "oio.v1.Event": _event,
    "oio.v1.GasReading": decode.reading,
    "oio.v1.Innovation": decode.innovation,
    "oio.v1.StageResult": _stage,
    "foxglove.Odometry": lambda t_ns, data: BelievedNose(*decode.odometry(t_ns, data)),
    "foxglove.FrameTransforms": arm_frames,
    "foxglove.SceneUpdate": _scene,
}

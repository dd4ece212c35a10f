"""Checks units of the Functional Mock-up Interface with FMPy: their description, and their bits on recorded episodes."""

import json
import shutil
import sys

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu


def bits(words: list[str]) -> np.ndarray:
    return np.array([int(word, 16) for word in words], np.uint32).view(np.float32)


def episode(trace: str) -> tuple[int, np.ndarray, list]:
    """The seed, observations and actions of a trace's first episode."""
    lines = [json.loads(line) for line in open(trace)]
    seed = next(line["reset"]["seed"] for line in lines if "reset" in line)
    decisions = [line["decision"] for line in lines if "decision" in line]
    return seed, np.array([bits(d["observation"]) for d in decisions]), [d["action"] for d in decisions]


def is_discrete(description) -> bool:
    return any(variable.type == "Int32" for variable in description.modelVariables)


def simulate(unit: str, description, trace: str) -> int:
    """Plays an episode's observations to a unit, and compares its outputs with the recorded actions."""
    seed, rows, actions = episode(trace)
    period = float(description.coSimulation.fixedInternalStepSize)
    variables = description.modelVariables
    inputs = [variable.name for variable in variables if variable.causality == "input"]
    outputs = [variable.name for variable in variables if variable.causality == "output"]
    # Each value stands from its time to the next one's. FMPy interpolates between rows, and a missing value is NaN.
    signals = np.zeros(2 * len(rows), [("time", float)] + [(name, np.float32) for name in inputs])
    signals["time"] = np.arange(1, 2 * len(rows) + 1) // 2 * period
    for name, column in zip(inputs, rows.T, strict=True):
        signals[name] = np.repeat(column, 2)
    result = simulate_fmu(unit, start_values={"seed": seed}, input=signals, output=outputs,
                          stop_time=len(rows) * period, output_interval=period)
    # The first row is from before the first decision.
    assert len(result) == len(rows) + 1, (len(result), len(rows))
    for k, action in enumerate(actions):
        found = [result[name][k + 1] for name in outputs]
        if is_discrete(description):
            assert found == [int(action[0])], (k, found, action)
        else:
            found = np.array(found, np.float32)
            assert (found.view(np.uint32) == bits(action).view(np.uint32)).all(), (k, found, action)
    return len(rows)


def misuse(unit: str, description) -> None:
    """What the standard lets an importer do wrong is refused, and states can be kept."""
    folder = extract(unit)
    arguments = dict(unzipDirectory=folder, modelIdentifier=description.coSimulation.modelIdentifier)
    period = float(description.coSimulation.fixedInternalStepSize)
    try:
        other = FMU3Slave(guid="of another unit", instanceName="other", **arguments)
        refused(lambda: other.instantiate())
        slave = FMU3Slave(guid=description.guid, instanceName="one", **arguments)
        slave.instantiate()
        refused(lambda: slave.doStep(0.0, period))
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        inputs = [v.valueReference for v in description.modelVariables if v.causality == "input"]
        output = [v.valueReference for v in description.modelVariables if v.causality == "output"][:1]
        read = slave.getInt32 if is_discrete(description) else slave.getFloat32
        slave.setFloat32(inputs, [0.125] * len(inputs))
        refused(lambda: slave.doStep(0.0, 1.5 * period))
        refused(lambda: slave.setFloat32(output, [1.0]))
        refused(lambda: slave.getFloat64(inputs))
        refused(lambda: slave.getInt8(inputs))
        saved = slave.serializeFMUState(slave.getFMUState())
        slave.doStep(0.0, 3 * period)
        last = read(output)
        state = slave.deserializeFMUState(saved)
        slave.setFMUState(state)
        for k in range(3):
            slave.doStep(k * period, period)
        assert read(output) == last
        slave.freeFMUState(state)
        slave.terminate()
        slave.reset()
        slave.enterInitializationMode()
        slave.freeInstance()
    finally:
        shutil.rmtree(folder)


def refused(call) -> None:
    try:
        call()
    except Exception:
        return
    raise AssertionError("a wrong call is not refused")


for unit, trace in zip(sys.argv[1::2], sys.argv[2::2], strict=True):
    problems = validate_fmu(unit)
    assert not problems, problems
    description = read_model_description(unit)
    misuse(unit, description)
    print(unit, simulate(unit, description, trace), "decisions agree")

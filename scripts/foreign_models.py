"""Trains, scores, loops and exports other people's robots; see scripts/foreign-models.

usage: foreign_models.py TPG DIR    the program, and the folder with packages/, where descriptions and runs go
"""

import json
import os
import pathlib
import shlex
import shutil
import subprocess
import sys
import time

import mujoco

SUITE = "dm_control/suite/"
WALKERS = "dm_control/locomotion/walkers/assets/"
GYMNASIUM = "gymnasium/envs/mujoco/assets/"
ROBOTICS = "gymnasium_robotics/envs/"
ROBOSUITE = "robosuite/models/assets/robots/"
MODELS = (
    [
        SUITE + f"{name}.xml"
        for name in (
            "acrobot ball_in_cup cartpole cheetah dog finger fish hopper humanoid humanoid_CMU manipulator pendulum "
            "point_mass quadruped reacher stacker walker"
        ).split()
    ]
    + [WALKERS + "rodent.xml", WALKERS + "jumping_ball/jumping_ball_with_head.xml"]
    + [GYMNASIUM + f"{name}.xml" for name in ("ant", "humanoid", "point", "pusher_v5")]
    + [
        ROBOTICS + name
        for name in (
            "assets/adroit_hand/adroit_door.xml",
            "assets/adroit_hand/adroit_hammer.xml",
            "assets/fetch/pick_and_place.xml",
            "assets/hand/reach.xml",
            "assets/hand/manipulate_block.xml",
            "multiagent_mujoco/assets/coupled_half_cheetah.xml",
        )
    ]
    + [
        ROBOSUITE + f"{name}/robot.xml"
        for name in "baxter gr1 iiwa jaco kinova3 panda sawyer spot tiago ur5e xarm7".split()
    ]
)
# Seconds between two decisions.
PERIOD = 0.02
# Few trials of short episodes: whether it works is asked, not how well it learns.
TRAINING = shlex.split(
    "--seed 1 --threads 1 --generations 4 --set tuning.lines=1 --set tuning.iterations=2 --set tuning.directions=4 "
    "--set tuning.top=2 --set selection.candidates=0"
)


def describe(path, name, folder):
    """Writes the description of a task on a model; returns its path, and the numbers of inputs and outputs."""
    model = mujoco.MjModel.from_xml_path(str(path))
    actuators = []
    for k in range(model.nu):
        entry = f'actuator = "#{k}", name = "actuator_{k}"'
        if not model.actuator_ctrllimited[k]:
            entry += ", low = -1.0, high = 1.0"
        actuators.append("{ " + entry + " }")
    text = f"""name = "{name}-v1"
model = "{os.path.relpath(path, folder)}"
frame-skip = {max(1, round(PERIOD / model.opt.timestep))}
max-steps = 100
observation = [{{ source = "qpos:*", name = "position", unit = "1" }}, {{ source = "qvel:*", name = "velocity", unit = "1/s" }}]
actuator = [{", ".join(actuators)}]
reward = [{{ expression = "{{rate:com:x}}" }}, {{ kind = "control-cost", weight = 0.01 }}]
reset = {{ position-noise = 0.005, velocity-noise = 0.005 }}
"""
    file = folder / f"{name}.toml"
    file.write_text(text)
    return file, model.nq + model.nv, model.nu


def run(*command):
    """Runs a command; returns its standard output, or raises what it said."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        last = done.stderr.strip().splitlines() or ["nothing"]
        raise RuntimeError(f"status {done.returncode}: {last[-1]}")
    return done.stdout


def row(tpg, packages, out, model):
    """One robot's row of the table."""
    package, *_ = model.split("/")
    name = "-".join(part.lower() for part in pathlib.Path(model).with_suffix("").parts[-2:]).replace("_", "-")
    start = f"| {package} | {name} |"
    try:
        task, inputs, outputs = describe(packages / model, name, out)
    except ValueError as error:
        return False, f"{start} – | – | MuJoCo's own reader refuses it: {str(error).splitlines()[0]} | – | – | – | – | – |"
    start += f" {inputs} | {outputs} |"
    champion = out / "runs" / name / "champion.tpg"
    shutil.rmtree(champion.parent, ignore_errors=True)
    begin = time.monotonic()
    try:
        run(tpg, "train", "champion", "--task", task, "--out", champion.parent, *TRAINING)
        seconds = time.monotonic() - begin
        steps = int((champion.parent / "log.csv").read_text().splitlines()[-1].split(",")[1])
        score = ["--task", task, "--episodes", 3, "--json"]
        alone = json.loads(run(tpg, "eval", champion, *score))
        loop = json.loads(run(tpg, "hil", champion, *score))
        figures = json.loads(run(tpg, "inspect", champion, "--json"))
        run(tpg, "export", champion, "--rust", champion.parent / "policy.rs", "--c", champion.parent / "policy.c")
    except RuntimeError as error:
        return False, f"{start} {error} | – | – | – | – | – |"
    same = "equal" if alone["returns"] == loop["returns"] else "DIFFERENT"
    return same == "equal", (
        f"{start} {seconds:.1f} | {steps} | {alone['mean']:.2f} | {same} | {figures['blob_bytes']} | yes |"
    )


def main():
    tpg, out = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    print("| package | model | inputs | outputs | seconds | steps | mean of 3 episodes | loop | bytes | exported |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    whole = 0
    for model in MODELS:
        works, text = row(tpg, out / "packages", out, model)
        whole += works
        print(text, flush=True)
    print(f"\n{whole} of {len(MODELS)} models train, score, loop with the same returns, and export.")


if __name__ == "__main__":
    main()

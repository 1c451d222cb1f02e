"""What the bench `python` asks of Python: a line on standard input names a piece of work, its CPU time [s] is the answer.

    cargo bench --bench python     runs it; PYTHON names an interpreter in which `pip install ./python` was done
"""

import sys
import time

import numpy as np

import handeye
from handeye import servo


def calibrate(seed):
    rig = handeye.random_rig(6, 2, 12, seed)
    recording = handeye.simulate(rig, 50, 1).recording
    start = time.process_time()
    learned = handeye.calibrate(recording, threads=1)
    seconds = time.process_time() - start
    assert learned.converged
    return seconds


class Steps:
    """Steps of 6 joints towards 24 image points."""

    def __init__(self):
        rig = handeye.random_rig(6, 2, 12, 3)
        self.places = list(handeye.simulate(rig, 2001, 1).truth.joints)
        rig.lower, rig.upper, rig.max_velocity = np.full(6, -50.0), np.full(6, 50.0), np.full(6, np.inf)
        goal = rig.predict(self.places.pop())
        self.seen = [rig.predict(joints) for joints in self.places]
        self.stepper, self.goals = servo.Stepper(rig), [servo.ImagePoints(rig, goal)]
        self.controller = servo.ImageBased(rig)
        self.controller.aim(goal)

    def step(self):
        start = time.thread_time()
        for joints in self.places:
            self.stepper.step(joints, self.goals, dt=1.0).motion
        return (time.thread_time() - start) / len(self.places)

    def image_based(self):
        start = time.thread_time()
        for joints, seen in zip(self.places, self.seen):
            self.controller.decide(seen, joints, dt=100.0).command.value
        return (time.thread_time() - start) / len(self.places)


def main():
    steps = None
    for line in sys.stdin:
        name, *arguments = line.split()
        if name == "calibrate":
            answer = calibrate(int(arguments[0]))
        else:
            steps = steps or Steps()
            answer = getattr(steps, name)()
        print(answer, flush=True)


if __name__ == "__main__":
    main()

"""A scripted policy behind the guard: it swings the first joint to and fro.

    python scripted_policy.py

After two seconds something is held 20 cm before one ring of sensors for three: the guard lets the
arm give way instead, says why, and hands the policy its arm back afterwards. A real program reads
joints and frames where this one makes them up.

Limits: the guard knows what the skin sees, nothing else. It takes frames at the rate of the
sensors, and it stops the arm when half of them have been silent for half a second.
"""

import numpy as np

import flinch

DT, FRAME = 0.01, 0.066  # [s] between two steps, and between two frames of a sensor

NOISE = np.random.default_rng(0)


def policy(now: float) -> flinch.JointSpeeds:
    """What is wanted at a time, whatever is near."""
    qd = np.zeros(6)
    qd[0] = 0.3 * np.sign(np.sin(2.0 * now))
    return flinch.JointSpeeds(qd)


def skin_sees(guard: flinch.Guard, now: float) -> list[flinch.SensorFrame]:
    """A frame of every sensor: walls far away, or something near before the last ring."""
    frames = []
    for s in guard.skin.sensors:
        near = 2.0 <= now < 5.0 and s.name.startswith("ring3-")
        noise = NOISE.normal(1.0, 0.01, s.type.zones)  # one that repeats itself counts as broken
        frames.append(guard.frame(s.name, now, (0.2 if near else 2.0) * noise))
    return frames


def main(seconds: float = 8.0) -> list[flinch.Command]:
    """Run it, and print each time that the reason changes."""
    guard = flinch.Guard.of("ur10e")
    q, qd, told, commands, newest = guard.robot.home.copy(), np.zeros(6), "", [], -1.0
    for now in np.arange(0.0, seconds, DT):
        frames = []
        if now - newest >= FRAME:
            frames, newest = skin_sees(guard, now), now
        command = guard.step(frames, flinch.JointState(now, q.copy(), qd.copy()), policy(now))
        qd = np.array(command.qd)
        q += DT * qd  # an arm that follows
        words = command.reason.partition(",")[0]
        if words != told:
            print(f"{now:4.1f} s  {command.share:4.0%} of what is wanted  {command.reason}")
            told = words
        commands.append(command)
    return commands


if __name__ == "__main__":
    main()

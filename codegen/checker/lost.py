"""Whether the twin initialises correctly, and resumes correctly after invalid samples, replayed in rationals.

Standard library only; part of the checker (verify.py), which hands ``binding`` in. A certificate is about steps, and
these are none; but whoever may write into ``init``, ``_predict`` and ``_resume`` sets the states to what he likes. What
is asked of them is said by what the next good sample shows, and not by how they are written:

- after ``init`` velocities of zero, and all else the same whatever is measured;
- after a lost sample, with the machine going on at the held velocity, what would have been shown without it;
- after a good sample that ends many lost ones, with the machine going on so, the held estimates.
"""

import copy
import random
from collections.abc import Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import binding

POINTS = 12
MOST = (1, 2, 4, 8)
"""Lost samples in a row after which the state may be set from the next good one."""
BENDS = (
    "how the code begins, and goes on after lost samples: estimates of velocities are not linear in the positions, as "
    "where a sensor errs or a step is implicit, or `code` does not say how they move"
)
Records = dict[str, Any]


def compared(top: dict[str, Any], twin: Any) -> list[str]:
    """What of this cannot be compared, in words.

    Raises:
        binding.Unlike: where the twin does otherwise.
    """
    if not twin.records or not top["code"]["errors"]:
        return []  # which is said where the step is replayed
    parameters, dice = twin.record("Parameters"), random.Random(f"{binding.SECRET} lost")
    twin.run("prepare", parameters=parameters)
    try:
        here = Place(binding.Start(top, twin, parameters), dice)
        left = {gap for k in range(POINTS) for gap in here.gaps(binding.SLIPS[k % 3], binding.FORCES[k % 5])}
    except (binding.Unknown, ZeroDivisionError) as why:
        return [f"how the code begins, and goes on after lost samples: {why}"]
    return sorted(left)


class Place:
    """A state, the inputs and what was shown there, drawn anew for each comparison."""

    def __init__(self, start: Any, dice: random.Random) -> None:
        self.start, self.twin, self.dice = start, start.twin, dice
        self.motion, self.h = start.top["code"]["motion"], start.top["sample_time"]
        self.implicit = start.top["observer"]["integration"] == "implicit"
        self.at_once = "_predict" in self.twin.functions and self.most_lost() == 1

    def gaps(self, slip: Fraction, force: Fraction) -> Iterator[str]:
        """What is not compared, at one point of these sizes."""
        state, inputs = self.start.draw(self.dice, slip, force, False)
        other = self.start.draw(self.dice, slip, force, False)[1]
        before = copy.deepcopy((state, inputs))
        now = self.start.sample(state, inputs)  # from here on ``state`` is that of the next sample
        straight = self.is_straight(state, now)
        fresh = [self.begun(given) for given in (inputs, other)]
        if fresh[0] != fresh[1] or any(fresh[0][k] for k in self.start.velocities):
            yield from self.unlike("init shows what depends on the measurement, or a velocity", straight)
        if "_predict" in self.twin.functions:
            yield from self.missed(state, now, straight)
            yield from self.resumed(before[0], now, straight)

    def unlike(self, what: str, straight: bool) -> Iterator[str]:
        if straight:
            raise binding.Unlike(f"lost samples: {what}")
        yield BENDS

    def shown(self, state: Records, inputs: Records) -> list[Fraction]:
        """The estimates of all errors, the state left as it is."""
        now = self.start.sample(copy.deepcopy(state), copy.deepcopy(inputs))
        return [binding.read(text, now)[0] for text in self.start.places]

    def after(self, now: Records, samples: int) -> Records:
        """The inputs when the machine has gone on with the velocity that is shown."""
        moved: Records = copy.deepcopy(now["inputs"])
        for position, velocity in self.motion.items():
            new = binding.read(position, now)[0] + samples * self.h * binding.read(velocity, now)[0]
            binding.put(moved, binding.place(position)[1:], (new, Fraction(0)))
        return moved

    def is_straight(self, state: Records, now: Records) -> bool:
        """Whether `code` moves every position, and velocities are linear in them: second differences vanish."""
        if not {*self.start.velocities.values()} <= {*self.motion.values()}:
            return False
        seen = [self.shown(state, self.after(now, k)) for k in range(3)]
        return all(seen[2][k] - 2 * seen[1][k] + seen[0][k] == 0 for k in self.start.velocities)

    def begun(self, inputs: Records) -> list[Fraction]:
        """What is shown at the sample with which the code begins."""
        state = self.twin.run("init", parameters=self.start.parameters, inputs=inputs)["state"]
        self.require_use(state, "init")
        return self.shown(state, inputs)

    def require_use(self, state: Records, name: str) -> None:
        if any(state.get(field, (0, 0)) != (0, 0) for field in binding.MODE_FIELDS):
            raise binding.Unlike(f"lost samples: {name} leaves a state that is not running")

    def most_lost(self) -> int:
        """After how many lost samples in a row the mode is `HOLDING`, which they do not leave."""
        state, outputs, found = self.twin.record("State"), self.twin.record("Outputs"), []
        for _ in range(2 * MOST[-1]):
            self.twin.run("_predict", state=state, parameters=self.start.parameters, outputs=outputs)
            outputs["fault"] = (Fraction(1), Fraction(0))
            found.append(tuple(state[field][0] for field in binding.MODE_FIELDS))
        for most in MOST:
            if found == [(int(k >= most), min(k, most)) for k in range(1, len(found) + 1)]:
                return most
        raise binding.Unlike("lost samples: `_predict` does not hold after 1, 2, 4 or 8 of them")

    def missed(self, state: Records, now: Records, straight: bool) -> Iterator[str]:
        lost, kept = copy.deepcopy(state), copy.deepcopy(state)
        given = {"parameters": self.start.parameters, "outputs": now["outputs"]}
        self.twin.run("_predict", state=lost, **given)
        wanted, later = self.shown(state, self.after(now, 1)), self.after(now, 2)
        for part in (self.start.velocities, range(len(wanted))):  # friction is shown from the velocities
            found = self.shown(kept, later)
            for k in part:
                value, slope = binding.held(kept, self.start.slots[k])
                binding.put(kept, self.start.slots[k], (value + wanted[k] - found[k], slope))
        for k, slot in enumerate(self.start.slots):
            old, new, goes_on = (binding.held(record, slot)[0] for record in (state, lost, kept))
            # A level's own state may stay: what its slip did meanwhile is not known. A velocity's where it is set anew.
            stays = new == old and (k not in self.start.velocities or self.at_once)
            if new != goes_on and not stays:
                yield from self.unlike(f"after one {self.start.places[k]} is not what it was", straight)
        following = copy.deepcopy(state)
        self.start.sample(following, self.after(now, 1))
        for slot in binding.slots(state, self.start.others):
            if binding.held(lost, slot)[0] not in (binding.held(state, slot)[0], binding.held(following, slot)[0]):
                raise binding.Unlike(f"lost samples: `_predict` sets {slot[0]} to what no sample would")

    def resumed(self, state: Records, now: Records, straight: bool) -> Iterator[str]:
        new = copy.deepcopy(state)
        new |= dict.fromkeys(binding.MODE_FIELDS, (Fraction(1), Fraction(0)))  # which it is to leave
        given = {"parameters": self.start.parameters, "inputs": now["inputs"]}
        self.twin.run("_resume", state=new, outputs=now["outputs"], **given)
        self.require_use(new, "`_resume`")
        wanted = [binding.read(text, now)[0] for text in self.start.places]
        if self.shown(new, self.after(now, 0 if self.implicit else 1)) != wanted:
            yield from self.unlike("the sample that ends many lost ones does not go on from what was held", straight)
        fresh = self.twin.run("init", **given)["state"]
        following = copy.deepcopy(state)
        self.start.sample(following, now["inputs"])
        for slot in binding.slots(state, self.start.others):
            may = [binding.held(record, slot)[0] for record in (state, following, fresh)]
            if binding.held(new, slot)[0] not in may:
                raise binding.Unlike(f"lost samples: `_resume` sets {slot[0]} to what no sample would")

"""When what causes leave of a gap makes an answer `none`, `unknown` or a name."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """When a remainder makes a verdict.

    Attributes:
        deviations: by which a smooth function must predict the confirming rows for there to be a remainder.
        size: rms of what repeats, over the noise, that it must have somewhere; ignored without repeats.
        repeating: the same, above which there is a remainder whether or not it can be predicted.
        chance: probability that noise alone makes it that large in some coordinate, above which that is no remainder.
        beside: the same beside effects that are named, where the held-out gap can be measured.
        creeping: the same of rows whose noise is mostly what a model may lack.
        foreign: the same of rows that the model says nothing of; where no effect acts, `nearly` pardons it.
        explained: share of what can be predicted that the effects named must explain, or the answer is `unknown`.
        nearly: what one effect must close, over that and what all leave, where a remainder repeats; or all of it there.
        humble: whether no name is surer than that share, where a remainder repeats that is pardoned.
        improvement: share of the held-out gap from which every effect but one counts, whatever it gains.
        widening: share of the held-out gap by which an effect may seem to widen it.
        most: share of the held-out gap that all effects must close where nothing repeats.
        measurable: power of that gap, over the noise's, from which such a share is no accident of the noise.
        far_off: what the held-out gap may have beyond its noise, over that, to be called none.
        scarce: the same times the square root of the confirming rows, where those are few.
        law: share of the held-out gap that a law must close, and log of it that a law costs where explanations compete.
        name: log of it that a name costs there (several of them bend to a curve as well), and must gain beside others.
        blur: part of the noise's power that no explanation is asked to come nearer to than another, where they compete.
        unsteady: log evidence, for other sizes of the effects in some steps, from which they are not what they seem.
        bent: the same as a share of the evidence for the effects: columns are not quite what a large effect does.
        sized: standard deviations that an effect must have in size where something else comes along with it.
        sure_of: standard deviations from which that is there.
        curve: names for the friction of one kind of joint from which its law is one that the library does not have.
    """

    deviations: float = 3.0
    size: float = 0.25
    repeating: float = 0.5
    chance: float = 0.05
    beside: float = 0.35
    creeping: float = 1.5
    foreign: float = 1.0
    explained: float = 0.5
    nearly: float = 0.95
    humble: bool = False
    improvement: float = 0.01
    widening: float = 0.1
    most: float = 0.5
    measurable: float = 0.05
    far_off: float = 0.3
    scarce: float = 4.0
    law: float = 0.12
    name: float = 0.05
    blur: float = 0.5
    unsteady: float = 5.0
    bent: float = 1e-3
    sized: float = 2.0
    sure_of: float = 2.0
    curve: int = 3

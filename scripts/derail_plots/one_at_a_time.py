"""Plan one_at_a_time: what each input alone does to an outcome."""

import math
from dataclasses import dataclass

import numpy as np

from derail_plots.study_data import Column, Spread
from derail_plots.style import number


@dataclass(frozen=True)
class Setting:
    """One value of one input, all others at their base."""

    text: str  # SI, as in the files
    x: float  # its place on the axis: change in %, shown unit, or rank of a choice
    spread: Spread


@dataclass(frozen=True)
class Line:
    """An outcome over one input; settings rise in x, the base among them."""

    factor: Column
    base_text: str
    kind: str  # 'change', 'value' or 'choice'
    settings: list

    @property
    def known(self):
        return [s for s in self.settings if s.spread.known]

    @property
    def ends(self):
        """Settings at the lowest and the highest input (of choices: outcome), the base left out.

        None where there is none.
        """
        others = [s for s in self.known if s.text != self.base_text]
        if self.kind == 'choice':
            others.sort(key=lambda s: s.spread.median)
            return (others[0] if len(others) > 1 else None), (others[-1] if others else None)
        base_x = next(s.x for s in self.settings if s.text == self.base_text)
        below = [s for s in others if s.x < base_x]
        above = [s for s in others if s.x > base_x]
        return (below[0] if below else None), (above[-1] if above else None)


class Scale:
    """Turns an outcome into its change from the base in %, if the base is neither zero nor NaN."""

    def __init__(self, outcome, base):
        self.relative = base.known and base.median != 0.0
        self.base = base
        self.label = (
            f'change of {outcome.title}\N{NO-BREAK SPACE}(%)' if self.relative else outcome.label
        )

    def __call__(self, value):
        return 100.0 * (value / self.base.median - 1.0) if self.relative else value


def _changed(study, values):
    """The input in which a point differs from the base; None at the base."""
    return next((f for f in study.factors if values[f.name] != study.base[f.name]), None)


def _base_point(study):
    return next((p for p, values in study.points.items() if _changed(study, values) is None), None)


def base_spread(study, outcome):
    return study.spread(_base_point(study), outcome)


def _line(study, factor, outcome):
    base_text = study.base[factor.name]
    found = [(base_text, base_spread(study, outcome))]
    found += [
        (values[factor.name], study.spread(point, outcome))
        for point, values in study.points.items()
        if _changed(study, values) is factor
    ]
    if not factor.numeric:
        return Line(
            factor, base_text, 'choice', [Setting(t, i, s) for i, (t, s) in enumerate(found)]
        )
    base = factor.shown(base_text)
    relative = base != 0.0 and math.isfinite(base)
    settings = [
        Setting(t, 100.0 * (factor.shown(t) / base - 1.0) if relative else factor.shown(t), s)
        for t, s in found
    ]
    return Line(
        factor, base_text, 'change' if relative else 'value', sorted(settings, key=lambda s: s.x)
    )


def lines(study, outcome):
    """One Line an input."""
    return [_line(study, factor, outcome) for factor in study.factors]


def detail(study, outcome):
    """Second line of a heading: number of runs, and what the base yields."""
    base = base_spread(study, outcome)
    value = f'; base: {number(base.median)} {outcome.shown_unit}'.rstrip() if base.known else ''
    return study.counted + value


def _samples_by_setting(study, outcome):
    """{values of the inputs: what the runs there had}."""
    found = {}
    for point, value in zip(study.sample_points, study.samples[outcome.name]):
        found.setdefault(tuple(sorted(study.points[point].items())), []).append(value)
    return found


def probability_of_alike(study, other, outcome, exchanges=9999):
    """How often chance alone sets two equal studies as far apart; None if they have no point in common.

    Van Elteren's test: ranks within each point, by exchanging runs of the two within points; the same every time.
    """
    ours, theirs = _samples_by_setting(study, outcome), _samples_by_setting(other, outcome)
    random = np.random.default_rng(1)
    seen, by_chance = 0.0, np.zeros(exchanges)
    shared = [setting for setting in ours if setting in theirs]
    for setting in shared:
        a, b = np.array(ours[setting]), np.array(theirs[setting])
        pooled = np.concatenate([a, b])
        ranks = np.array([np.mean(pooled < v) + 0.5 * np.mean(pooled == v) for v in pooled])
        expected = len(a) * ranks.mean()
        seen += ranks[: len(a)].sum() - expected
        dealt = random.permuted(np.tile(ranks, (exchanges, 1)), axis=1)
        by_chance += dealt[:, : len(a)].sum(axis=1) - expected
    if not shared:
        return None
    return (1.0 + np.sum(np.abs(by_chance) >= abs(seen) - 1e-9)) / (1.0 + exchanges)

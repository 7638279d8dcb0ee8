#!/usr/bin/python3
"""Draws the results of a study: PNG and SVG in DIR/pictures, for print and readable without colour.

  rosrun train_derail plot_study.py DIR                 DIR: the folder that `derail study` has filled
  rosrun train_derail plot_study.py DIR --beside OTHER  two studies of the same inputs side by side, as of two engines

Exit codes: 0 done, 1 a picture could not be written, 2 something is wrong with DIR.
"""

import argparse
import os
import sys

sys.path.insert(
    0, os.path.dirname(os.path.realpath(__file__))
)  # a catkin devel space runs this file from elsewhere

from derail_plots import grid, random_plans, sensitivity, study_data, style, tornado  # noqa: E402
from derail_plots.errors import DataError  # noqa: E402

SAMPLED = {'distributions': random_plans.distributions}
BY_OUTCOME = {
    'one_at_a_time': {
        'tornado': tornado.tornado,
        'overview': sensitivity.overview,
        'bands': sensitivity.bands,
    },
    'grid': {'curves': grid.curves},
    'latin_hypercube': {'scatter': random_plans.scatter},
    'sobol': {'scatter': random_plans.scatter},
    'saltelli': {'scatter': random_plans.scatter},
}
OF_ALL_OUTCOMES = {
    'latin_hypercube': SAMPLED,
    'sobol': SAMPLED,
    'saltelli': {**SAMPLED, 'sobol': random_plans.sobol},
}
CAPTIONS = {
    'tornado': 'What the lowest and the highest value of each input do',
    'overview': 'Change over the change of each input',
    'beside': 'Change over the change of each input, two studies side by side',
    'bands': 'Change over the change of each input, with the range of the runs',
    'curves': 'Median and range of the runs over the inputs',
    'scatter': 'Every run over each input, and the trend',
    'distributions': 'How the outcomes are distributed over all runs',
    'sobol': "Sobol indices: shares of the inputs in an outcome's variance, with 95 % confidence",
}


def pictures(study):
    """(name, caption, figure) of every picture of a study."""
    if study.plan not in BY_OUTCOME:
        raise DataError(f"study.json: plan {study.plan!r} is not one of {', '.join(BY_OUTCOME)}")
    if not study.factors:  # an ensemble: nothing to draw it over
        yield 'distributions', f"{CAPTIONS['distributions']} ({study.counted})", random_plans.distributions(study)
        return
    for kind, draw in OF_ALL_OUTCOMES.get(study.plan, {}).items():
        yield kind, f'{CAPTIONS[kind]} ({study.counted})', draw(study)
    for outcome in study.outcomes:
        for kind, draw in BY_OUTCOME[study.plan].items():
            caption = (
                f'{outcome.title[0].upper()}{outcome.title[1:]}. {CAPTIONS[kind]} ({study.counted})'
            )
            yield f'{kind}_{outcome.name}', caption, draw(study, outcome)


def of_two(study, other):
    """(name, caption, figure) of the pictures that show two studies side by side."""
    for of in (study, other):
        if of.plan != 'one_at_a_time':
            raise DataError(f'{of.title}: plan {of.plan!r}; only one_at_a_time is drawn side by side')
    if [f.name for f in study.factors] != [f.name for f in other.factors]:
        raise DataError(f'{study.title} and {other.title} do not vary the same inputs')
    shared = {o.name for o in other.outcomes}
    if not any(o.name in shared for o in study.outcomes):
        raise DataError(f'{study.title} and {other.title} have no outcome in common')
    for outcome in study.outcomes:
        if outcome.name in shared:
            counted = f'{study.counted}; {other.counted}'
            caption = f'{outcome.title[0].upper()}{outcome.title[1:]}. {CAPTIONS["beside"]} ({counted})'
            yield f'beside_{outcome.name}', caption, sensitivity.beside(study, other, outcome)


def main(arguments=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('folder', metavar='DIR', help='results of derail study')
    parser.add_argument(
        '--beside', metavar='OTHER', help='results of another study; only pictures of both are drawn'
    )
    given = parser.parse_args(arguments)
    out = os.path.join(given.folder, 'pictures')
    style.apply()
    try:
        count = 0
        study = study_data.read(given.folder)
        drawn = of_two(study, study_data.read(given.beside)) if given.beside else pictures(study)
        for name, caption, figure in drawn:
            if figure is not None:
                count += len(style.save(figure, out, name, caption))
    except DataError as e:
        print(f'plot_study.py: {e}', file=sys.stderr)
        return 2
    except OSError as e:
        print(f'plot_study.py: {e.filename or out}: {e.strerror}', file=sys.stderr)
        return 1
    print(f'{count} pictures in {out}')
    return 0


if __name__ == '__main__':
    sys.exit(main())

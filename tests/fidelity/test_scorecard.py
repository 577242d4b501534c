import json

import numpy as np

from blesim.fidelity.scorecard import Statistic, inside_count, scorecard


def statistic(name, values):
    return Statistic(name=name, unit="dB", values=np.array(values, dtype=float))


def test_inside_is_between_5_and_95_percent_of_the_real_units():
    real = [statistic("a", range(101)), statistic("b", range(101))]
    scores = scorecard(real, [statistic("b", [95.5]), statistic("a", [94.0, 95.0, 96.0])])
    assert [(s.statistic, s.real, s.real_low, s.real_high) for s in scores] == [
        ("a", 50.0, 5.0, 95.0),
        ("b", 50.0, 5.0, 95.0),
    ]
    assert [score.inside for score in scores] == [True, False]
    assert inside_count(scores) == 1


def test_units_that_cannot_tell_do_not_count():
    scores = scorecard([statistic("a", [1, 2, np.nan, 3, 4])], [statistic("a", [np.nan, 2.5])])
    assert (scores[0].real, scores[0].simulated) == (2.5, 2.5)


def test_a_range_of_three_units_is_left_out():
    assert scorecard([statistic("a", [1, 2, 3, np.nan])], [statistic("a", [2])]) == ()


def test_a_twin_that_cannot_tell_is_out_and_null():
    score = scorecard([statistic("a", range(9))], [statistic("a", [])])[0]
    assert not score.inside
    told = json.loads(json.dumps(score.as_dict(), allow_nan=False))
    assert told["simulated"] is None
    assert list(told) == [
        "statistic",
        "unit",
        "real",
        "real_low",
        "real_high",
        "simulated",
        "inside",
    ]

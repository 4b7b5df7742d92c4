"""Tests whose wanted outcome the program does not reach today, each with the reason. Empty is the aim.

With ``pytest -m thorough`` they run and are counted as expected failures; one that passes again is shown as such and
leaves this list.
"""

from __future__ import annotations

CHANCE = (
    "the gusts of this day are alike by chance in runs of one direction, as a road of 0.02 % rms would make them "
    "(likelihood ratios of 70 and 2700, where 18 of 20 flat days have less than 10): the effects then differ by less"
)
PLAY = "with the open differential the size of free play is 13 % too small, more than its interval: not understood"
SECOND = (
    "a shaft stiffness 4.3 +- 1.6 % off is named beside the play, by chance: on other processors, whose sums round "
    "otherwise, the play alone"
)

KNOWN_FAILURES: dict[str, str] = {
    "test_what_is_promised_is_what_the_plant_says_of_driving_it[tires against brakes]": CHANCE,
    "test_brakes_that_let_go_slower_than_they_usually_do_are_still_brakes": CHANCE,
    "test_play_is_named_and_its_interval_holds_it[74-0.02]": SECOND,
    "test_a_size_that_is_begun_too_small_begins_again_where_all_impacts_fit": PLAY,
}

"""Mapping policy: when a belief map is due, and when the plume counts as lost; decided from the moves alone, without the truth."""

from collections.abc import Sequence
from typing import Annotated

from oio.core.settings import Within, refuse_below, settings
from oio.search.view import Move


@settings
class MappingPolicy:
    """Mapping schedule: explore, map, map again at growing intervals, and sooner while in doubt. Between maps the filter runs."""

    explore_moves: Annotated[int, Within(4, 1000)]  # minimum moves before the first map,
    min_whiffs: Annotated[int, Within(0, 1000)]  # and minimum moves with a whiff,
    explore_max_moves: Annotated[int, Within(4, 10_000)]  # but at most so many moves
    lost_moves: Annotated[int, Within(1, 10_000)]  # after so many silent moves in a row the plume is lost
    remap_factor: Annotated[float, Within(1, 100)]  # a new map is due after so many times the moves of the last one,
    recheck_moves: Annotated[int, Within(1, 10_000)]  # and while it is in doubt, after so many more moves
    # thorough_factor: every alternative world is fitted after so many times the moves of the last such map
    thorough_factor: Annotated[float, Within(1, 1e6)]

    def check(self) -> None:
        """Raise BadInput for a longest exploration below the shortest."""
        refuse_below(self, "explore_max_moves", "explore_moves")

    def lost(self, moves: Sequence[Move]) -> bool:
        """Return whether the plume is lost: the latest moves had no signal, so the source is not where it is believed."""
        return len(moves) >= self.lost_moves and all(move.silent for move in moves[-self.lost_moves :])

    def explored(self, moves: Sequence[Move]) -> bool:
        """Return whether these moves suffice for a first map."""
        whiffs = sum(move.whiff_q is not None for move in moves)
        return len(moves) >= self.explore_moves and (whiffs >= self.min_whiffs or len(moves) >= self.explore_max_moves)

    def due(self, moves: Sequence[Move], mapped: int, doubtful: bool) -> bool:
        """Return whether a map is due after these moves, the last one having been made after `mapped` of them (0: none yet).

        `doubtful`: several hypotheses are left, or the filter fails its NIS consistency test.
        """
        if mapped == 0:
            return self.explored(moves)
        if self.lost(moves[:-1]) and not self.lost(moves):
            return True  # the plume was reacquired
        return len(moves) >= self.remap_factor * mapped or (doubtful and len(moves) >= mapped + self.recheck_moves)

    def thorough(self, moves: int, last: int) -> bool:
        """Return whether a map after so many moves fits every alternative world, the last such map having been made after `last` moves."""
        return moves >= self.thorough_factor * last

"""When a belief map is made, and when the plume counts as lost: decided from the moves alone, without the truth."""

from collections.abc import Sequence

from oio.core.settings import in_range, settings
from oio.search.view import Move


@settings
class MappingPolicy:
    """Explore, map, map again ever more seldom; sooner in doubt. Between maps the filter runs."""

    explore_moves: int  # moves before the first map, at least;
    min_whiffs: int  # and until so many of them had a whiff,
    explore_max_moves: int  # but so many at most
    lost_moves: int  # after so many silent moves the plume is lost, until a move has a whiff
    remap_factor: float  # the map is made anew after so many times the moves of the last one,
    recheck_moves: int  # and while it is in doubt, after so many moves

    def check(self) -> None:
        """Refuse a search that cannot make its first map: a position takes five measurements."""
        in_range(
            self,
            explore_moves=(4, 1000),
            min_whiffs=(0, 1000),
            explore_max_moves=(self.explore_moves, 10_000),
            lost_moves=(1, 10_000),
            remap_factor=(1.0, 100.0),
            recheck_moves=(1, 10_000),
        )

    def lost(self, moves: Sequence[Move]) -> bool:
        """Whether the latest moves smelt nothing: wherever the source is believed, it is elsewhere."""
        return len(moves) >= self.lost_moves and all(move.silent for move in moves[-self.lost_moves :])

    def explored(self, moves: Sequence[Move]) -> bool:
        """Whether these moves suffice for a first map."""
        whiffs = sum(move.smelt is not None for move in moves)
        return len(moves) >= self.explore_moves and (whiffs >= self.min_whiffs or len(moves) >= self.explore_max_moves)

    def due(self, moves: Sequence[Move], mapped: int, doubtful: bool) -> bool:
        """Whether a map is due after these moves, the last one having been made after `mapped` of them (0: none yet).

        `doubtful`: hypotheses compete, or the filter is not consistent with its innovations.
        """
        if mapped == 0:
            return self.explored(moves)
        if self.lost(moves[:-1]) and not self.lost(moves):
            return True  # the plume was found again
        return len(moves) >= self.remap_factor * mapped or (doubtful and len(moves) >= mapped + self.recheck_moves)

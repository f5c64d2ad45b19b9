"""Criteria of a search: what its motion could see, in what world, and is the region small enough to be a place."""

from typing import Annotated, ClassVar

from oio.core.settings import Within, settings
from oio.inference.map_fit import CALIBRATED
from oio.results.criteria.judgement import RECALIBRATE, SEARCH, Criterion, Measured, Results
from oio.results.evaluation import Evaluation

SNIFF_LONGER = "Sniff longer (stage.navigate.max_moves), nearer, or with a stronger source."


def evaluation(results: Results) -> Evaluation | None:
    """Result of the stage `evaluate`, if it ran."""
    found = results.get(Evaluation)
    return found if isinstance(found, Evaluation) else None


@settings
class Observable(Criterion):
    """Directions and ambiguities that this motion cannot resolve, by the rank of the Fisher information and the geometry of the path."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """Number of them; with one or two joints there is one at least."""
        found = evaluation(results)
        if found is None:
            return None
        unseen = [*_missing_joints(found.findings.dof), *found.findings.unseen]
        first, *others = unseen or ["every direction of the source is observable"]
        said = " ".join([first, *(sentence[:1].upper() + sentence[1:] for sentence in others)])
        return Measured(
            float(len(unseen)), "1", said.rstrip("."), above="Use more joints (dof), or tell the source's strength (range_law.ln_strength)."
        )

    def allowed(self, unit: str) -> str:
        """In words: any of them costs the PASS."""
        return "all observable"


@settings
class SameWorld(Criterion):
    """Whether the calibrated world explains the search (0), another one does better, such as a wall, a wind, a second source (1), or not
    even that one does, by the overdispersion of its residuals (2)."""

    about: ClassVar[str] = SEARCH
    unexplained: Annotated[float, Within(1.0, 1e6)]  # overdispersion from which another world does not explain the search either

    def measure(self, results: Results) -> Measured | None:
        """None without a map."""
        found = evaluation(results)
        if found is None or found.calibrated.believed_m is None:
            return None
        world, residuals = found.calibrated.world, found.findings.residuals
        if world == CALIBRATED:
            return Measured(0.0, "1", "the calibrated world explains the search")
        if residuals is not None and residuals.overdispersion > self.unexplained:
            said = f"the calibrated world does not explain the search, and {world}, which does better, does not either"
            return Measured(2.0, "1", said, above=RECALIBRATE)
        return Measured(1.0, "1", f"{world} explains the search better", above=RECALIBRATE)

    def allowed(self, unit: str) -> str:
        """In words, as the value is yes or no."""
        return "the calibrated world"


@settings
class Places(Criterion):
    """Places that the last map leaves for the source: with more than one the answer is one of them."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """None without a map."""
        found = evaluation(results)
        if found is None or found.calibrated.believed_m is None:
            return None
        places = 1 + len(found.calibrated.other_places)
        return Measured(
            float(places), "1", "one place explains the readings" if places == 1 else f"{places} places explain the readings alike",
            above="Sniff where they differ: raise stage.navigate.max_moves, or use more joints.",
        )  # fmt: skip


@settings
class Localised(Criterion):
    """Standard deviation of the source over that of the whole workspace box: a region as large as the room is no place."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """With one or two joints only a bearing is observable, which is judged by `Observable`."""
        found = evaluation(results)
        if found is None or found.findings.dof < 3:
            return None
        sd_m = found.calibrated.sd_m
        if sd_m is None:
            return Measured(1.0, "of the box", "no map was made: the source is not localisable", above="Raise stage.navigate.max_moves.")
        share = sd_m / found.findings.box_sd_m
        not_localisable = "" if self.warns[1] is None or share <= self.warns[1] else ", which is as good as anywhere: not localisable"
        return Measured(
            share, "of the box", f"the source is known to +- {1e3 * sd_m:.0f} mm, {share:.3f} of the workspace box{not_localisable}",
            above=SNIFF_LONGER,
        )  # fmt: skip


@settings
class Declared(Criterion):
    """Whether the search declared a source by its own stop rule (1), ran out of moves or time (0), or made no map at all (-1)."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """With one or two joints nothing can be declared."""
        found = evaluation(results)
        if found is None or found.findings.dof < 3:
            return None
        outcome = found.calibrated
        if outcome.believed_m is None:
            return Measured(
                -1.0, "1", f"{outcome.moves} moves, and no map: there is nothing to declare", below="Raise stage.navigate.max_moves."
            )
        said = f"declared after {outcome.moves} moves" if outcome.found else f"the source was not declared within {outcome.moves} moves"
        return Measured(
            float(outcome.found), "1", said, below="The position is unverified: raise stage.navigate.max_moves.",
        )  # fmt: skip

    def allowed(self, unit: str) -> str:
        """In words, as the value is yes or no."""
        return "declared"


def _missing_joints(dof: int) -> list[str]:
    if dof >= 3:
        return []
    what = "height and distance" if dof == 1 else "distance (a source and its inverse point give the same readings)"
    return [f"{what} cannot be found with dof={dof}; only the bearing is observable. Add joints: dof=3 or dof=5."]

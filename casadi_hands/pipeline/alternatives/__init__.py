"""Several hands for one task: solved from several seeds, ranked, and the best distinct ones kept."""

from casadi_hands.pipeline.alternatives.folder import remove_alternatives, seed_folder
from casadi_hands.pipeline.alternatives.ranking import Alternative
from casadi_hands.pipeline.alternatives.seeds import explore

__all__ = ["Alternative", "explore", "remove_alternatives", "seed_folder"]

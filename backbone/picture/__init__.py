"""One picture of a mission: what components publish and answer, folded into one model, and the words for it."""

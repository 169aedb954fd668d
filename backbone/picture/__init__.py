"""One picture of a mission: one model of the components' publications and answers, and the words for it."""

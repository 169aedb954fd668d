"""The mission's log: events of components, actions of people, and the question that selects among them."""

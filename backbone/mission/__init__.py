"""From mission.xml to a checked mission description."""

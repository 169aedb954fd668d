"""What other tools show of a mission without a plug-in: Foxglove, Lichtblick, Rerun."""

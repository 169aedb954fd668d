"""What every component is and does."""

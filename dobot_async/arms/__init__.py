"""What the arms of all families do alike."""

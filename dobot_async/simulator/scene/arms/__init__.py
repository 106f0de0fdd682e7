"""What each family's arm is in a scene."""

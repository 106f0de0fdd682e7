"""What teaching needs of each family."""

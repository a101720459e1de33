"""What a user sees while a verb works and when it cannot."""

"""What contacts carry beside their motion: the protocol of a contact state, and those that are known."""

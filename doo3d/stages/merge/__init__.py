"""Former place of the costs of the user."""

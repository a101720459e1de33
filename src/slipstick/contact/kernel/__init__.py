"""The compiled batch of contact elements: ``batch`` runs it, ``element`` is one of it, ``tuples`` what they share."""

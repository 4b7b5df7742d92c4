"""Roads of drives whose grade was not logged."""

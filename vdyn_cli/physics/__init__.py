"""Laws of single elements (laws/) and the models assembled from them (models/)."""

"""What the frames mean: cloud, self filter, static filter, closest pairs."""

"""What stands: floor plan, obstacles, line of sight, aisle graph, beacons, product sections."""

"""What a user says: problem, mesh options, solver options, validated."""

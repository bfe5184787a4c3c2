"""Results for ParaView."""

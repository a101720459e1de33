"""Integration in time, from event to event."""

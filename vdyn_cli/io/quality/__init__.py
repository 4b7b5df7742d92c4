"""Quality checks of a log: of one channel, and of channels that physics relates."""

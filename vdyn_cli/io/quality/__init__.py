"""Whether a log measured: checks of one channel and of channels that physics ties."""

"""Reading what instruments wrote: CSV logs and pictures. Nothing here knows physics."""

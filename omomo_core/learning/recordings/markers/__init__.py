"""Objects that were captured with markers: tracks and the markers' places on a scan become poses."""

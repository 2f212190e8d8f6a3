"""The picture on a scan's mesh: unwrapped, painted from the best pictures, seams levelled."""

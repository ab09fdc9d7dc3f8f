"""The diagnosis on logs of an independent simulator; scoring code, which reads the truth of each log."""

"""The diagnosis on logs of an independent simulator; scoring code, so it reads the truth that lies beside them."""

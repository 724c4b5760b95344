"""stub"""
def read_usd(path, issues, limits):
    raise NotImplementedError

"""Scene files and models of users: text -> fields -> a canonical scene and its checks."""

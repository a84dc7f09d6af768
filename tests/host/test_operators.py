"""The shared `register` and `unregister`."""

from calmotion.host import registration


class Calls:
    """A host that notes what it is asked to do."""

    def __init__(self):
        self.made = []

    def register_operator(self, cls):
        self.made.append(("add", cls))

    def unregister_operator(self, cls):
        self.made.append(("remove", cls))


def test_operators_are_added_in_order_and_removed_in_reverse():
    register, unregister = registration(int, str)
    host = Calls()
    register(host)
    unregister(host)
    assert host.made == [("add", int), ("add", str), ("remove", str), ("remove", int)]

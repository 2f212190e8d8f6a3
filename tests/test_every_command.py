"""No command is documented and dead: the fast suite calls each with real input."""

from tests.commands import commands, marked_tests


def test_every_command_is_called_by_a_fast_test():
    called = marked_tests()
    assert sorted(set(commands()) - set(called)) == []
    assert sorted(set(called) - set(commands())) == []

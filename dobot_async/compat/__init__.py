r"""Old blocking programs, with one import changed: the names and arguments of other libraries, on `dobot_async.sync`.

    pydobot.Dobot, pydobotplus.Dobot   DobotDllType.SetPTPCmd, ...   dobotlab.magician
                  \                              |                       /
                   '------------------------ Session -------------------'
                                                 |
                                       dobot_async.sync.Magician

1. A call returns what its library's returns, once that is true; an alarm, a lost arm or a refused command is raised.
2. A motion that nobody waits for is followed all the same: if it fails, the next call raises that.
3. An error, Ctrl-C or `close()` while an error is handled stops the arm. A normal end waits for what was queued.

docs/compat.md has the table of what is the same, what is better, and what is not there.
"""

"""The two modules of pair.py, each in a process of its own.  python docs/examples/pair_in_processes.py"""

from pair import Smoothing, Wave

from mission_control.modules.run_in_processes import run_in_processes

if __name__ == "__main__":
    run_in_processes(Wave(), Smoothing(), frequency_hz=20, for_s=2, listen={"smooth": print})

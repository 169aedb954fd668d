"""Two connected modules: one makes a wave, the other smooths it.  python docs/examples/pair.py"""

from backbone.wire import Message
from mission_control.modules.module import Module


class Height(Message, frozen=True):
    height_m: float


class Wave(Module):
    class Outputs(Module.Outputs):
        wave: Height

    def reset(self) -> None:
        self.step = 0

    def update(self, inputs: Module.Inputs) -> Outputs:
        self.step += 1
        return self.Outputs(Height(float(self.step % 8)))


class Smoothing(Module):
    class Inputs(Module.Inputs):
        wave: Height

    class Outputs(Module.Outputs):
        smooth: Height

    class Parameters(Module.Parameters, frozen=True):
        weight: float = 0.25

    class State(Module.State):
        height_m: float = 0.0

    parameters: Parameters
    state: State

    def update(self, inputs: Inputs) -> Outputs:
        self.state.height_m += self.parameters.weight * (inputs.wave.height_m - self.state.height_m)
        return self.Outputs(Height(self.state.height_m))


if __name__ == "__main__":
    from mission_control.modules.run import run

    run(Wave(), Smoothing(), frequency_hz=20, for_s=2, listen={"smooth": print})

# SPDX-License-Identifier: MIT
"""The bench of bench.fmu in Python: a class that is stepped, and a function of a whole record."""

from math import ceil, pi, sqrt


class Bench:
    """A valve-controlled cylinder."""

    inputs = ("command_v", "force_n", "supply_pressure_pa", "flow_a_m3_s", "flow_b_m3_s")
    outputs = ("position_m", "velocity_m_s", "pressure_a_pa", "pressure_b_pa")
    parameters = dict(  # noqa: C408, RUF012 -- as users write it
        mass=150.0,
        viscous_friction=1400.0,
        bulk_modulus=1.0e9,
        rated_flow=5.5e-4,
        valve_frequency=80.0,
    )

    def reset(self, parameters=None, position_m=0.175):
        """Goes back to rest at a position, with these values; the others are `parameters`."""
        for name, value in {**self.parameters, **(parameters or {})}.items():
            setattr(self, name, value)
        supply, self.tank, self.stroke = 1.4e7, 3e5, 0.35
        self.area_a, self.area_b = pi / 4 * 0.063**2, pi / 4 * (0.063**2 - 0.036**2)
        low = 0.5 * (supply + self.tank) * pi / 4 * 0.063**2 / (0.5 * (self.area_a + self.area_b))
        self.state = [position_m, 0.0, low * self.area_b / self.area_a, low, 0.0, 0.0]
        return self.read()

    def read(self):
        """Returns the outputs."""
        return tuple(self.state[:4])

    def step(
        self,
        dt,
        command_v,
        force_n=0.0,
        supply_pressure_pa=1.4e7,
        flow_a_m3_s=0.0,
        flow_b_m3_s=0.0,
    ):
        """Advances by dt with the inputs held; a positive force extends the rod."""
        steps = max(1, ceil(dt / 1e-4 - 1e-9))
        h = dt / steps
        u = min(1.0, max(-1.0, command_v / 10.0))

        def slopes(state):
            return self._slopes(state, u, force_n, supply_pressure_pa, flow_a_m3_s, flow_b_m3_s)

        for _ in range(steps):
            s = self.state
            a = slopes(s)
            b = slopes([p + 0.5 * h * q for p, q in zip(s, a, strict=True)])
            c = slopes([p + 0.5 * h * q for p, q in zip(s, b, strict=True)])
            d = slopes([p + h * q for p, q in zip(s, c, strict=True)])
            self.state = [
                p + h / 6 * (q + 2 * r + 2 * t + z)
                for p, q, r, t, z in zip(s, a, b, c, d, strict=True)
            ]
        return self.read()

    def _slopes(self, state, u, force, supply, flow_a, flow_b):
        y, v, pa, pb, x, xd = state
        k, w = self.rated_flow / sqrt(3.5e6), 2 * pi * self.valve_frequency

        def orifice(drop):
            return drop / sqrt(sqrt(drop * drop + 1e10))

        if x >= 0:
            qa, qb = k * x * orifice(supply - pa), -k * x * orifice(pb - self.tank)
        else:
            qa, qb = k * x * orifice(pa - self.tank), -k * x * orifice(supply - pb)
        stop = 0.0
        if y < 0:
            stop = -5e6 * y - 2e4 * v
        elif y > self.stroke:
            stop = -5e6 * (y - self.stroke) - 2e4 * v
        pressed = pa * self.area_a - pb * self.area_b
        volume_a = 3e-4 + self.area_a * y
        volume_b = 2.6e-4 + self.area_b * (self.stroke - y)
        return (
            v,
            (pressed - self.viscous_friction * v + force + stop) / self.mass,
            self.bulk_modulus / volume_a * (qa - self.area_a * v + flow_a),
            self.bulk_modulus / volume_b * (qb + self.area_b * v + flow_b),
            xd,
            w * w * (u - x) - 1.8 * w * xd,
        )


def simulate(command_v, dt, parameters=None, position_m=0.175, ports=None):
    """Simulates a whole record: the other form that a simulator may have."""
    bench = Bench()
    found = [bench.reset(parameters, position_m)]
    for i, u in enumerate(command_v[:-1]):
        now = {name: values[i] for name, values in (ports or {}).items()}
        found.append(bench.step(dt, u, **now))
    return {name: [one[i] for one in found] for i, name in enumerate(Bench.outputs)}

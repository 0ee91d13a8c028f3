# SPDX-License-Identifier: MIT
from collections.abc import Sequence
from enum import IntEnum
from typing import Any, ClassVar, TypeAlias, final
import numpy as np
import numpy.typing as npt
__version__: str
_Array: TypeAlias = npt.NDArray[np.float64]
_Samples: TypeAlias = npt.NDArray[np.float32] | npt.NDArray[np.float64]

class Status(IntEnum):
    ok = 0
    filling = 1
    no_information = 2
    disabled = 3
    reset = 4
    invalid_input = 5
    out_of_range = 6
    numerical_limit = 7
    invalid_argument = 8

def is_error(status: Status) -> bool:
    ...

@final
class PolicySetting:

    @property
    def name(self) -> str:
        ...

    @property
    def member(self) -> str:
        ...

    @property
    def unit(self) -> str:
        ...

    @property
    def range(self) -> str:
        ...

    @property
    def meaning(self) -> str:
        ...

    @property
    def default(self) -> float:
        ...

    @property
    def per_parameter(self) -> bool:
        ...

    @property
    def hil_place(self) -> int:
        ...

@final
class PolicyInfo:

    @property
    def id(self) -> str:
        ...

    @property
    def policy(self) -> type[Forgetting]:
        ...

    @property
    def summary(self) -> str:
        ...

    @property
    def source(self) -> str:
        ...

    @property
    def number(self) -> int:
        ...

    @property
    def takes_size(self) -> bool:
        ...

    @property
    def settings(self) -> tuple[PolicySetting, ...]:
        ...
HIL_PLACES: int

def policies() -> tuple[PolicyInfo, ...]:
    ...
Forgetting: TypeAlias = Constant | Exponential | ErrorDriven | FRatio | Directional | RandomWalk

class Constant:
    info: ClassVar[PolicyInfo]

    def __init__(self, lambda_: float=0.99) -> None:
        ...

    @property
    def lambda_(self) -> float:
        ...

    @property
    def forgets_the_start(self) -> bool:
        ...

class Exponential:
    info: ClassVar[PolicyInfo]

    def __init__(self, lambda0: float=0.99, lambda_initial: float=0.95) -> None:
        ...

    @property
    def lambda0(self) -> float:
        ...

    @property
    def lambda_initial(self) -> float:
        ...

    @property
    def forgets_the_start(self) -> bool:
        ...

class ErrorDriven:
    info: ClassVar[PolicyInfo]

    def __init__(self, memory: float=100.0, lambda_min: float=0.5, noise_variance: float=0.0) -> None:
        ...

    @property
    def memory(self) -> float:
        ...

    @property
    def lambda_min(self) -> float:
        ...

    @property
    def noise_variance(self) -> float:
        ...

    @property
    def forgets_the_start(self) -> bool:
        ...

class FRatio:
    info: ClassVar[PolicyInfo]

    def __init__(self, eta: float=2.0, critical_ratio: float=3.3) -> None:
        ...

    @property
    def eta(self) -> float:
        ...

    @property
    def critical_ratio(self) -> float:
        ...

    @property
    def forgets_the_start(self) -> bool:
        ...

class Directional:
    info: ClassVar[PolicyInfo]

    def __init__(self, lambda_: float=0.94, epsilon: float=0.0001) -> None:
        ...

    @property
    def lambda_(self) -> float:
        ...

    @property
    def epsilon(self) -> float:
        ...

    @property
    def forgets_the_start(self) -> bool:
        ...

class RandomWalk:
    info: ClassVar[PolicyInfo]

    def __init__(self, drift: float | Sequence[float]=0.0001) -> None:
        ...

    @property
    def drift(self) -> list[float]:
        ...

    @property
    def forgets_the_start(self) -> bool:
        ...

class RlsOptions:

    def __init__(self, *, information_margin: float=-1.0, covariance_ceiling: float=1.0) -> None:
        ...

    @staticmethod
    def textbook() -> RlsOptions:
        ...

    @property
    def information_margin(self) -> float:
        ...

    @property
    def covariance_ceiling(self) -> float:
        ...

class Scaling:

    def __init__(self, *, command_scale: float=1.0, position_scale: float=1.0, command_offset: float=0.0, position_offset: float=0.0) -> None:
        ...

    @property
    def command_scale(self) -> float:
        ...

    @property
    def position_scale(self) -> float:
        ...

    @property
    def command_offset(self) -> float:
        ...

    @property
    def position_offset(self) -> float:
        ...

class RmseResetOptions:

    def __init__(self, *, short_window: float=10.0, long_window: float=200.0, trigger_ratio: float=3.0, release_ratio: float=1.5, cool_down: int=50, floor: float=1e-05) -> None:
        ...

    @property
    def short_window(self) -> float:
        ...

    @property
    def long_window(self) -> float:
        ...

    @property
    def trigger_ratio(self) -> float:
        ...

    @property
    def release_ratio(self) -> float:
        ...

    @property
    def cool_down(self) -> int:
        ...

    @property
    def floor(self) -> float:
        ...

class ConvergenceOptions:

    def __init__(self, *, tolerance: float=0.05, magnitude: float=0.1, hold: int=20) -> None:
        ...

    @property
    def tolerance(self) -> float:
        ...

    @property
    def magnitude(self) -> float:
        ...

    @property
    def hold(self) -> int:
        ...

class GradientOptions:

    def __init__(self, *, settling: int=200, start_pole: float=0.7, fading: float=0.99, model_rate: float=0.03) -> None:
        ...

    @property
    def settling(self) -> int:
        ...

    @property
    def start_pole(self) -> float:
        ...

    @property
    def fading(self) -> float:
        ...

    @property
    def model_rate(self) -> float:
        ...

@final
class Trajectory:

    @property
    def theta(self) -> _Samples:
        ...

    @property
    def standard_deviation(self) -> _Samples:
        ...

    @property
    def innovation(self) -> _Samples:
        ...

    @property
    def forgetting_factor(self) -> _Samples:
        ...

    @property
    def residual_variance(self) -> _Samples:
        ...

    @property
    def status(self) -> npt.NDArray[np.uint8]:
        ...

    @property
    def converged(self) -> npt.NDArray[np.bool_] | None:
        ...

class Rls:

    def __init__(self, n: int, *, forgetting: Forgetting=..., options: RlsOptions=..., theta0: Sequence[float] | _Array=[], variance0: Sequence[float] | _Array=[], dtype: npt.DTypeLike='float64') -> None:
        ...

    def start_from_covariance(self, theta0: Sequence[float] | _Array, p0: npt.ArrayLike) -> None:
        ...

    def predict(self, phi: npt.ArrayLike) -> float:
        ...

    def update(self, phi: npt.ArrayLike, y: float) -> Status:
        ...

    def run(self, phi: npt.ArrayLike, y: npt.ArrayLike) -> Trajectory:
        ...

    def reset(self) -> None:
        ...

    def reset_all(self) -> None:
        ...

    def save(self) -> bytes:
        ...

    def restore(self, state: bytes) -> None:
        ...

    @property
    def n(self) -> int:
        ...

    @property
    def dtype(self) -> np.dtype[Any]:
        ...

    @property
    def theta_hat(self) -> _Array:
        ...

    @property
    def standard_deviation(self) -> _Array:
        ...

    @property
    def gain(self) -> _Array:
        ...

    @property
    def P(self) -> _Array:
        ...

    @property
    def innovation(self) -> float:
        ...

    @property
    def forgetting_factor(self) -> float:
        ...

    @property
    def residual_variance(self) -> float:
        ...

class ServoEstimator:

    def __init__(self, na: int, nb: int, nk: int, *, offset: bool=False, forgetting: Forgetting=..., scaling: Scaling=..., rls: RlsOptions=..., reset: RmseResetOptions | None=..., convergence: ConvergenceOptions=..., theta0: Sequence[float] | _Array=[], variance0: Sequence[float] | _Array=[], input_limit: float | None=None, method: str='rls', gradient: GradientOptions=..., dtype: npt.DTypeLike='float32') -> None:
        ...

    def seed(self, theta: Sequence[float] | _Array, u: npt.ArrayLike, d: Sequence[float] | _Array, noise_variance: float=0.0) -> None:
        ...

    def step(self, command: float, position: float) -> Status:
        ...

    def run(self, u: npt.ArrayLike, y: npt.ArrayLike) -> Trajectory:
        ...

    def reset(self) -> None:
        ...

    def save(self) -> bytes:
        ...

    def restore(self, state: bytes) -> None:
        ...

    @property
    def enabled(self) -> bool:
        ...

    @enabled.setter
    def enabled(self, arg1: bool) -> None:
        ...

    @property
    def n(self) -> int:
        ...

    @property
    def dtype(self) -> np.dtype[Any]:
        ...

    @property
    def theta_hat(self) -> _Array:
        ...

    @property
    def standard_deviation(self) -> _Array:
        ...

    @property
    def covariance(self) -> _Array:
        ...

    @property
    def gain(self) -> _Array:
        ...

    @property
    def P(self) -> _Array:
        ...

    @property
    def innovation(self) -> float:
        ...

    @property
    def forgetting_factor(self) -> float:
        ...

    @property
    def residual_variance(self) -> float:
        ...

    @property
    def settled(self) -> bool:
        ...

    @property
    def converged(self) -> bool:
        ...

    @property
    def residuals_white(self) -> bool:
        ...

    @property
    def whiteness(self) -> float:
        ...

    @property
    def excitation(self) -> float:
        ...

    @property
    def resets(self) -> int:
        ...

class EstimatorBank:

    def __init__(self, estimators: Sequence[ServoEstimator], *, instructions: str='') -> None:
        ...

    def load(self) -> None:
        ...

    def run(self, u: npt.ArrayLike, y: npt.ArrayLike, *, every: int=1, threads: int=1) -> Trajectory:
        ...

    @property
    def instructions(self) -> str:
        ...

class ServoParameters:

    def __init__(self, *, k_v: float, k_q: float, k_c: float, c_p: float, a_p: float, v_t: float, beta_e: float, m_t: float) -> None:
        ...

    @property
    def k_v(self) -> float:
        ...

    @property
    def k_q(self) -> float:
        ...

    @property
    def k_c(self) -> float:
        ...

    @property
    def c_p(self) -> float:
        ...

    @property
    def a_p(self) -> float:
        ...

    @property
    def v_t(self) -> float:
        ...

    @property
    def beta_e(self) -> float:
        ...

    @property
    def m_t(self) -> float:
        ...

class ContinuousServo:

    def __init__(self, *, gain: float, omega_n: float, xi: float) -> None:
        ...

    @property
    def gain(self) -> float:
        ...

    @property
    def omega_n(self) -> float:
        ...

    @property
    def xi(self) -> float:
        ...

class ServoReadingStatus(IntEnum):
    ok = 0
    not_finite = 1
    invalid_argument = 2
    no_integrator = 3
    poles_not_separable = 4
    pole_near_zero = 5
    negative_real_pole = 6
    unstable_pole = 7
    aliasing = 8
    no_gain = 9
    numerical_limit = 10

@final
class ServoReading:

    @property
    def status(self) -> ServoReadingStatus:
        ...

    @property
    def description(self) -> str:
        ...

    @property
    def gain(self) -> float:
        ...

    @property
    def gain_std(self) -> float:
        ...

    @property
    def omega_n(self) -> float:
        ...

    @property
    def omega_n_std(self) -> float:
        ...

    @property
    def xi(self) -> float:
        ...

    @property
    def xi_std(self) -> float:
        ...

    @property
    def covariance(self) -> _Array:
        ...

    @property
    def integrator_pole(self) -> float:
        ...

    @property
    def integrator_pole_std(self) -> float:
        ...

    @property
    def integrator_distance(self) -> float:
        ...

    @property
    def zoh_mismatch(self) -> float:
        ...

    @property
    def zoh_mismatch_chi2(self) -> float:
        ...

def continuous_servo(parameters: ServoParameters) -> ContinuousServo:
    ...

def discretise(servo: ContinuousServo, dt_s: float) -> _Array:
    ...

def identify_servo(theta: npt.ArrayLike, covariance: npt.ArrayLike, dt_s: float) -> ServoReading:
    ...

@final
class PlantParameter:

    @property
    def name(self) -> str:
        ...

    @property
    def unit(self) -> str:
        ...

    @property
    def meaning(self) -> str:
        ...

    @property
    def minimum(self) -> float:
        ...

    @property
    def maximum(self) -> float:
        ...

    @property
    def typical(self) -> float:
        ...

    @property
    def power(self) -> float:
        ...

@final
class MachineScale:

    def __init__(self, *, force_n: float, rated_flow_m3_s: float, full_flow_m3_s: float, pressure_pa: float, stroke_m: float, has_valve: bool) -> None:
        ...

    @property
    def force_n(self) -> float:
        ...

    @property
    def rated_flow_m3_s(self) -> float:
        ...

    @property
    def full_flow_m3_s(self) -> float:
        ...

    @property
    def pressure_pa(self) -> float:
        ...

    @property
    def stroke_m(self) -> float:
        ...

    @property
    def has_valve(self) -> bool:
        ...

@final
class EffectInfo:

    @property
    def id(self) -> str:
        ...

    @property
    def subsystem(self) -> str:
        ...

    @property
    def equation(self) -> str:
        ...

    @property
    def source(self) -> str:
        ...

    @property
    def excitation(self) -> str:
        ...

    @property
    def sensors(self) -> str:
        ...

    @property
    def least_size(self) -> str:
        ...

    @property
    def parameters(self) -> tuple[PlantParameter, ...]:
        ...

    @property
    def needs(self) -> tuple[str, ...]:
        ...

    @property
    def reach(self) -> str:
        ...

    @property
    def contains(self) -> str | None:
        ...

    @property
    def together_with(self) -> str | None:
        ...

    @property
    def nuisance(self) -> str | None:
        ...

    @property
    def not_below(self) -> tuple[tuple[str, str], ...]:
        ...

    @property
    def log_place(self) -> str:
        ...

    @property
    def does_not_commute(self) -> tuple[str, ...]:
        ...

    def starts(self, machine: MachineScale) -> list[dict[str, float]]:
        ...

    def matters(self, sizes: dict[str, float], machine: MachineScale) -> bool:
        ...

    def simplified(self, sizes: dict[str, float]) -> dict[str, float]:
        ...

    def same(self, simple: dict[str, float]) -> dict[str, float]:
        ...

    def grown(self, simple: dict[str, float], machine: MachineScale) -> list[dict[str, float]]:
        ...

@final
class EffectTerms:

    def __init__(self, values: npt.ArrayLike) -> None:
        ...

    @property
    def delay_s(self) -> float:
        ...

    @property
    def overlap(self) -> tuple[float, float]:
        ...

    @property
    def spool_lag(self) -> tuple[float, float]:
        ...

    @property
    def supply_line(self) -> tuple[float, float]:
        ...

    @property
    def pressure_line(self) -> tuple[float, float, float]:
        ...

    @property
    def hanging_load(self) -> tuple[float, float, float]:
        ...

    @property
    def sensor_error(self) -> tuple[float, float]:
        ...

    def command(self, command: npt.ArrayLike, dt_s: float) -> _Array:
        ...

    def sensor(self, position_m: npt.ArrayLike, dt_s: float) -> _Array:
        ...

    def position_of(self, reading_m: npt.ArrayLike) -> _Array:
        ...

    def opening(self, spool: npt.ArrayLike) -> _Array:
        ...

    def flow_share(self, time_s: npt.ArrayLike) -> _Array:
        ...

    def friction(self, velocity_m_s: npt.ArrayLike, from_middle_m: npt.ArrayLike) -> _Array:
        ...

    def load(self, from_middle_m: npt.ArrayLike) -> _Array:
        ...

    def bulk_modulus(self, beta_pa: float, pressure_pa: npt.ArrayLike) -> _Array:
        ...

    def leakage(self, pressure_a_pa: npt.ArrayLike, pressure_b_pa: npt.ArrayLike, tank_pressure_pa: float) -> tuple[_Array, _Array]:
        ...

def effects() -> tuple[EffectInfo, ...]:
    ...

def plant_outputs() -> tuple[str, ...]:
    ...

def plant_tables() -> tuple[tuple[str, ...], tuple[str, ...]]:
    ...

def plant_parameters() -> tuple[PlantParameter, ...]:
    ...

class Plant:

    def __init__(self, plant: str, values: npt.ArrayLike, *, dt_s: float, substeps: int=2, tables: Sequence[tuple[str, str, npt.ArrayLike]]=[]) -> None:
        ...

    def read(self) -> _Array:
        ...

    def advance(self, command_v: float) -> None:
        ...

    def run(self, command: npt.ArrayLike) -> _Array:
        ...

def plant_substeps(plant: str, values: npt.ArrayLike, dt_s: float) -> int:
    ...

def simulate_plant(plant: str, values: npt.ArrayLike, command: npt.ArrayLike, *, dt_s: float, substeps: int=2, varied: Sequence[int]=[], watched: Sequence[int] | None=None, aligned: npt.ArrayLike | None=None, threads: int=0, tables: Sequence[tuple[str, str, npt.ArrayLike]]=[], disturbances: Sequence[tuple[str, npt.ArrayLike]]=[]) -> tuple[_Array, _Array]:
    ...

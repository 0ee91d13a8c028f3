// Written by `ehsid export`, ehsid 0.2.0; do not edit, export again.
// Settings and start of the online estimator, and a self-test for the target. Numbers are float32 in
// hexadecimal, exact to the bit; decimals are for people.
//
// Record hydraulic_crane.csv, sha256
// 3fd24a1fe2d09e4635d068aea802cae4bebe600b7691387647fca79c80c9b4ba
// Made by tests/export/make_headers.py
//
// Results are bit for bit those of Python where the compiler does not fuse multiplications and additions
// (-ffp-contract=off, as the CMake target ehsid::reproducible sets it), nor uses -ffast-math.
// clang-format off
#pragma once

#include <cstdint>
#include <cstring>
#include <ehsid/ehsid.hpp>

namespace f_ratio {

/// na = 2, nb = 3, nk = 2, constant term.
using Estimator =
    ehsid::ArxEstimator<float, 2, 3, 2, ehsid::FRatio<float>, true>;

/// Sampling time of the record, s; the parameters hold for no other.
inline constexpr float kDtS = 0x1.99999ap-5F;  // 0.05

/// theta_0, in the units of the signals about the offsets of the scaling.
inline constexpr ehsid::Array<float, Estimator::kN> kTheta0 = {{
    -0x1.c872bp+0F,  // a1 = -1.783
    0x1.aa161ep-1F,  // a2 = 0.8322
    0x1.46c226p-2F,  // b1 = 0.3191
    -0x1.8b020cp+0F,  // b2 = -1.543
    0x1.256042p+0F,  // b3 = 1.146
    0x1.13c686p-14F,  // offset = 6.575e-05
}};

/// P_0 = U D U' of the scaled parameters in units of sigma^2: D, then the columns of U above its diagonal.
inline constexpr ehsid::UdFactors<float, Estimator::kN> kFactors0 = {
    {{
        0x1.4794eap-7F,  // 0.009997
        0x1.fced92p-2F,  // 0.497
        0x1.c8755p-6F,  // 0.02786
        0x1.427efap+2F,  // 5.039
        0x1.440a3ep+6F,  // 81.01
        0x1.4801f8p-7F,  // 0.01001
    }},
    {{
        -0x1.f9e83ep-1F,  // -0.9881
        -0x1.94af5p-2F,  // -0.3952
        -0x1.a1b08ap-2F,  // -0.4079
        0x1.892cdp-4F,  // 0.09599
        -0x1.81c2e4p-4F,  // -0.09418
        -0x1.ffbe76p-1F,  // -0.9995
        0x1.3ffac2p-6F,  // 0.01953
        -0x1.2ccf6cp-6F,  // -0.01836
        0x1.e68db8p-1F,  // 0.9503
        -0x1.f2f1aap+0F,  // -1.949
        -0x1.400fbap-5F,  // -0.03907
        0x1.4eb9a2p-5F,  // 0.04086
        -0x1.063f14p-2F,  // -0.2561
        0x1.73fb7ap-9F,  // 0.002838
        0x1.0710ccp-2F,  // 0.2569
    }},
};

/// sigma^2 of the offline model, squared units of the position.
inline constexpr float kNoiseVariance = 0x1.672324p-7F;  // 0.01096

/// Sets the estimator up and starts it from the offline model; ok, unless this file was changed.
inline ehsid::Status configure(Estimator& estimator) {
  Estimator::Options options;
  options.scaling.command_scale = 0x1.60d1b8p-1F;  // 0.6891
  options.scaling.position_scale = 0x1.845a1cp+0F;  // 1.517
  options.scaling.command_offset = -0x1.875f7p-3F;  // -0.1911
  options.scaling.position_offset = 0x1.7b634ep-8F;  // 0.005789
  options.forgetting.eta = 0x1.8p+0F;  // 1.5
  options.forgetting.critical_ratio = 0x1.8p+1F;  // 3
  options.rls.information_margin = 0x1.8p+0F;  // 1.5
  options.rls.covariance_ceiling = 0x1p+1F;  // 2
  options.reset.short_window = 0x1.4p+2F;  // 5
  options.reset.long_window = 0x1.ep+5F;  // 60
  options.reset.trigger_ratio = 0x1p+1F;  // 2
  options.reset.release_ratio = 0x1.8p+0F;  // 1.5
  options.reset.cool_down = 50;
  options.reset.floor = 0x1.4f8b58p-17F;  // 1e-05
  options.convergence.tolerance = 0x1.99999ap-4F;  // 0.1
  options.convergence.magnitude = 0x1.99999ap-4F;  // 0.1
  options.convergence.hold = 10;
  options.variance0 = Estimator::Parameters::Constant(Estimator::kN, 0x1.e848p+19F);  // 1e+06
  options.input_limit = 0x1.f4p+9F;  // 1000
  const ehsid::Status status = estimator.configure(options);
  if (status != ehsid::Status::ok) {
    return status;
  }
  return estimator.seed(ehsid::to_vector<Estimator::kN>(Estimator::kN, kTheta0), kFactors0, kNoiseVariance);
}

/// A sample of the golden trace: command and position in their units, and the innovation after it.
struct TraceSample {
  float command;
  float position;
  float innovation;
};

inline constexpr ehsid::Array<TraceSample, 16> kTrace = {{
    {0x1.ae429ep-1F, -0x1.8e9332p+1F, 0x0p+0F},
    {0x1.77429ap-1F, -0x1.8f540ap+1F, 0x0p+0F},
    {0x1.37829p-1F, -0x1.926558p+1F, 0x0p+0F},
    {0x1.f20536p-2F, -0x1.9500a6p+1F, 0x0p+0F},
    {0x1.7c853cp-2F, -0x1.971f36p+1F, -0x1.561194p-3F},
    {0x1.13854p-2F, -0x1.8dd0bap+1F, -0x1.504686p-4F},
    {0x1.5f0a1cp-3F, -0x1.0d773cp+1F, 0x1.8f877ap-1F},
    {0x1.921484p-4F, -0x1.98ed52p-1F, 0x1.fb141ap-3F},
    {0x1.9428e2p-5F, 0x1.7cd926p-3F, -0x1.2acadp-2F},
    {0x1.a0a37ap-7F, 0x1.52d2bcp+0F, 0x1.b2cd04p-3F},
    {-0x1.cf5bf4p-7F, 0x1.13b7f6p+1F, -0x1.4eb40cp-3F},
    {-0x1.b3d6fcp-5F, 0x1.6231dp+1F, 0x1.db1afep-10F},
    {-0x1.51eb86p-4F, 0x1.b5eacap+1F, 0x1.19988p-2F},
    {-0x1.79eb7ep-4F, 0x1.c239cp+1F, -0x1.01010cp-2F},
    {-0x1.79eb7ep-4F, 0x1.bc0ddap+1F, 0x1.79adfep-6F},
    {-0x1.79eb7ep-4F, 0x1.b30f34p+1F, 0x1.800a7ep-4F},
}};

/// theta_hat after the trace.
inline constexpr ehsid::Array<float, Estimator::kN> kTraceTheta = {{
    -0x1.bdb54p+0F,  // -1.74105
    0x1.99b006p-1F,  // 0.800171
    0x1.854f14p+1F,  // 3.04148
    -0x1.dece5p+2F,  // -7.48134
    0x1.16b5fap+2F,  // 4.35486
    0x1.1975cp-8F,  // 0.00429474
}};

inline bool same_bits(float left, float right) {
  std::uint32_t left_bits = 0;
  std::uint32_t right_bits = 0;
  std::memcpy(&left_bits, &left, sizeof left);
  std::memcpy(&right_bits, &right, sizeof right);
  return left_bits == right_bits;
}

/// Runs the trace through an estimator of its own, sizeof(Estimator) bytes on the stack. True where every
/// innovation and the last theta_hat are, bit for bit, those that Python computed.
inline bool self_test() {
  Estimator estimator;
  bool same = configure(estimator) == ehsid::Status::ok;
  for (const TraceSample& sample : kTrace) {
    same = !ehsid::is_error(estimator.step(sample.command, sample.position)) &&
           same_bits(estimator.innovation(), sample.innovation) && same;
  }
  const Estimator::Parameters theta = estimator.theta_hat();
  for (int i = 0; i < Estimator::kN; ++i) {
    same = same_bits(theta[i], ehsid::entry(kTraceTheta, i)) && same;
  }
  return same;
}

}  // namespace f_ratio

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

namespace random_walk {

/// na = 2, nb = 1, nk = 0.
using Estimator =
    ehsid::ArxEstimator<float, 2, 1, 0, ehsid::RandomWalk<float, 3>>;

/// Sampling time of the record, s; the parameters hold for no other.
inline constexpr float kDtS = 0x1.99999ap-5F;  // 0.05

/// theta_0, in the units of the signals about the offsets of the scaling.
inline constexpr ehsid::Array<float, Estimator::kN> kTheta0 = {{
    -0x1.d126eap+0F,  // a1 = -1.817
    0x1.bb8bacp-1F,  // a2 = 0.8663
    -0x1.5ce5b4p-4F,  // b1 = -0.08518
}};

/// P_0 = U D U' of the scaled parameters in units of sigma^2: D, then the columns of U above its diagonal.
inline constexpr ehsid::UdFactors<float, Estimator::kN> kFactors0 = {
    {{
        0x1.4855dap-7F,  // 0.01002
        0x1.fdf3b6p-2F,  // 0.498
        0x1.c3dee8p-6F,  // 0.02758
    }},
    {{
        -0x1.f9e83ep-1F,  // -0.9881
        -0x1.178d5p-1F,  // -0.546
        -0x1.068db8p-2F,  // -0.2564
    }},
};

/// sigma^2 of the offline model, squared units of the position.
inline constexpr float kNoiseVariance = 0x1.719f8p-7F;  // 0.01128

/// Sets the estimator up and starts it from the offline model; ok, unless this file was changed.
inline ehsid::Status configure(Estimator& estimator) {
  Estimator::Options options;
  options.scaling.command_scale = 0x1.60d1b8p-1F;  // 0.6891
  options.scaling.position_scale = 0x1.845a1cp+0F;  // 1.517
  options.scaling.command_offset = -0x1.875f7p-3F;  // -0.1911
  options.scaling.position_offset = 0x1.7b634ep-8F;  // 0.005789
  options.forgetting.drift[0] = 0x1.0624dep-10F;  // 0.001
  options.forgetting.drift[1] = 0x1.a36e2ep-14F;  // 0.0001
  options.forgetting.drift[2] = 0x1.4f8b58p-17F;  // 1e-05
  options.rls.information_margin = 0x1.8p+0F;  // 1.5
  options.rls.covariance_ceiling = 0x1p+1F;  // 2
  options.reset_enabled = false;
  options.convergence.tolerance = 0x1.99999ap-4F;  // 0.1
  options.convergence.magnitude = 0x1.99999ap-4F;  // 0.1
  options.convergence.hold = 10;
  options.variance0.setConstant(0x1.e848p+19F);  // 1e+06
  options.input_limit = 0x1.f4p+9F;  // 1000
  const ehsid::Status status = estimator.configure(options);
  if (status != ehsid::Status::ok) {
    return status;
  }
  return estimator.seed(ehsid::as_vector(kTheta0), kFactors0, kNoiseVariance);
}

/// A sample of the golden trace: command and position in their units, and the innovation after it.
struct TraceSample {
  float command;
  float position;
  float innovation;
};

inline constexpr ehsid::Array<TraceSample, 64> kTrace = {{
    {-0x1.a27d68p-1F, 0x1.cc72c4p+0F, 0x0p+0F},
    {-0x1.e0fd7ep-1F, 0x1.1a8cf2p+1F, 0x0p+0F},
    {-0x1.0c9eecp+0F, 0x1.2d7688p+1F, -0x1.5e1b7cp-3F},
    {-0x1.245eb4p+0F, 0x1.372c68p+1F, -0x1.7abd8ap-7F},
    {-0x1.321ea4p+0F, 0x1.3932aep+1F, -0x1.5c927ep-7F},
    {-0x1.3c1e7ap+0F, 0x1.2cd974p+1F, -0x1.2e97b4p-4F},
    {-0x1.411e64p+0F, 0x1.147c46p+1F, -0x1.374aaap-4F},
    {-0x1.475ec8p+0F, 0x1.ed5158p+0F, -0x1.852014p-5F},
    {-0x1.4a7efap+0F, 0x1.aac9d6p+0F, -0x1.91dc7ep-5F},
    {-0x1.4b1ee2p+0F, 0x1.5e4276p+0F, -0x1.3ad61cp-4F},
    {-0x1.4b1ee2p+0F, 0x1.3ebb08p+0F, 0x1.ebed78p-4F},
    {-0x1.4b1ee2p+0F, 0x1.01d402p+0F, -0x1.424fdcp-3F},
    {-0x1.4a7efap+0F, 0x1.844a8p-1F, -0x1.3a14cap-4F},
    {-0x1.4a7efap+0F, 0x1.1015eep-1F, -0x1.c5bafap-5F},
    {-0x1.439eaep+0F, 0x1.7893b2p-2F, -0x1.2c033ep-6F},
    {-0x1.38fefp+0F, 0x1.06c95ap-2F, -0x1.9cdf14p-6F},
    {-0x1.2efe72p+0F, 0x1.a9646ep-3F, -0x1.54d6cep-7F},
    {-0x1.1f5ec8p+0F, 0x1.8dcc78p-3F, -0x1.b41054p-6F},
    {-0x1.05beap+0F, 0x1.e29d2p-3F, 0x1.36f1ecp-8F},
    {-0x1.c7fd6p-1F, 0x1.4c6c2ep-2F, 0x1.0611b4p-6F},
    {-0x1.7bbd7cp-1F, 0x1.d0d458p-2F, 0x1.e92648p-6F},
    {-0x1.2f7d74p-1F, 0x1.2d1f32p-1F, 0x1.1073dep-6F},
    {-0x1.c3faf4p-2F, 0x1.80390ap-1F, 0x1.daf67cp-5F},
    {-0x1.32fad6p-2F, 0x1.dd5418p-1F, 0x1.22b7a4p-4F},
    {-0x1.52f5dcp-3F, 0x1.291172p+0F, 0x1.e312fap-4F},
    {-0x1.63d70ap-5F, 0x1.0c9e34p+0F, -0x1.f5bd26p-3F},
    {0x1.4c1476p-4F, 0x1.c9f9f6p-1F, 0x1.1fdd34p-6F},
    {0x1.910a14p-3F, 0x1.f1c8c8p-2F, -0x1.96bac6p-3F},
    {0x1.39053ap-2F, -0x1.6a0228p-7F, -0x1.2a7f6ap-4F},
    {0x1.9d052ap-2F, -0x1.37840cp-3F, 0x1.607e38p-2F},
    {0x1.f98528p-2F, -0x1.b9baf2p-2F, -0x1.e4088ap-4F},
    {0x1.24c294p-1F, -0x1.ae1ab8p-1F, -0x1.192968p-3F},
    {0x1.468294p-1F, -0x1.357d72p+0F, -0x1.a558c4p-13F},
    {0x1.65c29p-1F, -0x1.bf34bap+0F, -0x1.c1958ep-3F},
    {0x1.7b0292p-1F, -0x1.2180ep+1F, -0x1.0a825p-4F},
    {0x1.8c829cp-1F, -0x1.451c16p+1F, 0x1.0dc0c8p-3F},
    {0x1.9a428ep-1F, -0x1.95a2e2p+1F, -0x1.cd4ecp-2F},
    {0x1.a30292p-1F, -0x1.b2618cp+1F, 0x1.188bb6p-2F},
    {0x1.abc298p-1F, -0x1.ca4b4ep+1F, -0x1.60834cp-4F},
    {0x1.b5c29p-1F, -0x1.e74358p+1F, -0x1.3db47p-3F},
    {0x1.c3828p-1F, -0x1.f41346p+1F, 0x1.164de8p-6F},
    {0x1.d14292p-1F, -0x1.fb700ap+1F, -0x1.b623f2p-5F},
    {0x1.e04296p-1F, -0x1.f978f4p+1F, -0x1.527e12p-7F},
    {0x1.ef429ap-1F, -0x1.e7ff6cp+1F, 0x1.ae881ep-5F},
    {0x1.ff829p-1F, -0x1.e0af2ep+1F, -0x1.07cc7ap-3F},
    {0x1.08811cp+0F, -0x1.cc0acp+1F, 0x1.00f6cep-4F},
    {0x1.11e108p+0F, -0x1.b38b4cp+1F, 0x1.d06a52p-8F},
    {0x1.1dc14p+0F, -0x1.8fb27ap+1F, 0x1.4bec7ap-4F},
    {0x1.27212ep+0F, -0x1.7e266p+1F, -0x1.0a4758p-3F},
    {0x1.312104p+0F, -0x1.627f62p+1F, 0x1.726cfep-4F},
    {0x1.3c6152p+0F, -0x1.53312p+1F, -0x1.120ec8p-4F},
    {0x1.42a10ep+0F, -0x1.425202p+1F, 0x1.40670cp-5F},
    {0x1.47a0fap+0F, -0x1.37f9c6p+1F, -0x1.1e3c68p-6F},
    {0x1.48e172p+0F, -0x1.2713a2p+1F, 0x1.504a2p-4F},
    {0x1.48e172p+0F, -0x1.216002p+1F, -0x1.889298p-5F},
    {0x1.48e172p+0F, -0x1.22fa5cp+1F, -0x1.a72162p-6F},
    {0x1.48418ap+0F, -0x1.29252cp+1F, -0x1.8e014ep-7F},
    {0x1.466128p+0F, -0x1.32c0e4p+1F, -0x1.5a13d4p-7F},
    {0x1.44817p+0F, -0x1.3de15ap+1F, -0x1.5a65cp-9F},
    {0x1.4340f6p+0F, -0x1.4876d6p+1F, 0x1.0136e6p-7F},
    {0x1.40c154p+0F, -0x1.56628ep+1F, -0x1.b2e562p-6F},
    {0x1.3e410cp+0F, -0x1.6381f6p+1F, -0x1.dd79cap-10F},
    {0x1.3bc16ap+0F, -0x1.7293b4p+1F, -0x1.bf63fap-6F},
    {0x1.3a8198p+0F, -0x1.7fc576p+1F, -0x1.9ad8a4p-9F},
}};

/// theta_hat after the trace.
inline constexpr ehsid::Array<float, Estimator::kN> kTraceTheta = {{
    -0x1.d09ce4p+0F,  // -1.81489
    0x1.b61f78p-1F,  // 0.855709
    -0x1.53ee1ep-4F,  // -0.0829908
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

}  // namespace random_walk

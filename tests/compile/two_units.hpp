// SPDX-License-Identifier: MIT
#pragma once

/// theta_hat[0] after the same few steps, computed by each unit with its own instantiation.
float first_parameter_in_a();
float first_parameter_in_b();

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"
#include "curlew/shader/ShaderText.h"
#include "curlew/track/Stepper.h"

#include <optional>

namespace curlew {

struct FlowShaderOptions {
    Dialect dialect = Dialect::glsl;
    ShaderTables tables = ShaderTables::text;
    ShaderCoordinates coordinates = ShaderCoordinates::doubles; ///< In GLSL 4.50.
    ShaderBindings bindings = {};
    Scheme scheme = Scheme::rk4; ///< Of a step.
    int corrections = 2;         ///< Gauss-Newton corrections after a step: 1 … 10.
    /// The largest residual of f and g after a step, relative to their root mean squares. Float has about 1e-6.
    double tolerance = 4e-6;
    /// The position, world units, from which the shader measures its own; by default the centre of the domain's box.
    std::optional<Vec3d> origin = {};
    /// Write only the parts of a step, for a host that takes it in several passes: flowHere(), flowWall(),
    /// flowCorrected() and flowAccepts(), and flowHereAndWall(), which is written only then.
    bool parts = false;
    std::string dataFile = "the data file"; ///< Name of the file of the buffers; named in the header.
};

/// Writes a flow in two or three dimensions as functions of a shader, with first derivatives that are exact:
/// flowVelocity(p) and, if the flow has tracks, flowPotentials(p) and flowReproject(p, track, limit); flowDistance(p)
/// if it has a wall; flowStep() and flowAdvance(), which move a particle in time on its track and keep it out of the
/// wall; and the parts of which these are made. The text's header describes them. The formulas are those of the fields
/// themselves, recorded (math/Symbol.h).
///
/// Positions are floats relative to the origin. At the same positions, values are within 2e-6 of those of the flow
/// (1e-5 for noises on the integer lattice), velocities within 5e-5, both relative to their root mean squares. Tested
/// on a Vulkan device.
///
/// flowStep() checks what a step of a particle checks (track/Advect.h), but rejects any step between two sides of a
/// thin part of the wall. Throws ValueError if N is above 3, if a field cannot be written in the dialect, or an option
/// is out of range.
template <int N>
ShaderText flowShader(const FlowN<N>& flow, const FlowShaderOptions& options = {}, const Monitor& monitor = {});

} // namespace curlew

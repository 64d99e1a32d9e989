// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Context.h"
#include "curlew/vdb/SolidDistance.h"

namespace curlew::app {

/// The meshes from which the wall of a flow was made. The wall that a flow keeps to is the spline of a level set; these
/// tell how far that is from the meshes themselves.
class WallSolids {
  public:
    /// Finds the meshes behind an input, which is a flow. Keeps them in the node's memory for the next frame. Returns
    /// nullopt if the wall was not made from level sets of meshes, or if the memory does not suffice.
    static std::optional<WallSolids> of(const Context& c, const char* input);

    /// Judges points by the meshes.
    WrongSide wrongSide(std::span<const double> x, std::span<const double> y, std::span<const double> z,
                        const Monitor& monitor) const;
    /// Size of the level sets' voxels, the largest if they differ, world units.
    double voxel() const { return mVoxel; }

  private:
    std::vector<std::shared_ptr<const SolidDistance>> mSolids;
    Side mSide = Side::both;
    double mVoxel = 0;
};

} // namespace curlew::app

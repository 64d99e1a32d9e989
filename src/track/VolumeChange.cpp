#include "curlew/track/VolumeChange.h"

#include <algorithm>

namespace curlew {

VolumeChange volumeChange(const FlowInTime& flow, const std::vector<Vec3d>& positions, double begin,
                          AdvectOptions options, double h, const Monitor& monitor) {
    const Vec3d size = flow.at(begin).domain().box.size();
    if (h == 0) h = 1e-4 * std::max({size[0], size[1], size[2]});
    if (!(h > 0) || !std::isfinite(h)) throw ValueError("differences need a finite step: give the domain a finite box");
    // What reprojection leaves has to be small against h.
    options.reprojection.tolerance = std::min(options.reprojection.tolerance, 1e-11);
    std::vector<Vec3d> neighbours;
    for (Vec3d p : positions)
        for (int axis = 0; axis < 3; ++axis)
            for (const double side : {h, -h}) {
                neighbours.push_back(p);
                neighbours.back()[axis] += side;
            }
    Points around = Points::at(neighbours);
    advect(flow, around, begin, options, monitor);
    const auto end = [&](size_t k) { return around.position(k); };
    std::vector<double> determinants;
    for (size_t k = 0; k < around.size(); k += 6) {
        const auto* converged = &around.converged[k];
        if (!std::all_of(converged, converged + 6, [](uint8_t c) { return c != 0; })) continue;
        const Vec3d x = end(k) - end(k + 1), y = end(k + 2) - end(k + 3), z = end(k + 4) - end(k + 5);
        determinants.push_back(dot(x, cross(y, z)) / (8 * h * h * h));
    }
    if (determinants.empty()) return {};
    std::sort(determinants.begin(), determinants.end());
    const size_t last = determinants.size() - 1;
    return {determinants.size(), determinants[last / 2], determinants[last / 20], determinants[last - last / 20]};
}

} // namespace curlew

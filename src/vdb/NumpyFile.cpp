// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/NumpyFile.h"

#include "ChunkedWriter.h"
#include "CurveArrays.h"
#include "DenseBox.h"
#include "FiniteChecks.h"
#include "PointArrays.h"
#include "ZipWriter.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/LocalFile.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <functional>
#include <set>
#include <type_traits>
#include <utility>

namespace curlew {

namespace {

namespace fs = std::filesystem;
using openvdb::GridBase;

/// Returns NumPy's name of a number type.
template <class T>
constexpr const char* dtypeOf() {
    if constexpr (std::is_same_v<T, float>) return "<f4";
    if constexpr (std::is_same_v<T, double>) return "<f8";
    if constexpr (std::is_same_v<T, int32_t>) return "<i4";
    if constexpr (std::is_same_v<T, int64_t>) return "<i8";
    if constexpr (std::is_same_v<T, bool>) return "|b1";
}

/// Returns "(3,)" or "(4, 4)", as Python writes a tuple.
std::string tupleOf(const std::vector<size_t>& shape) {
    std::string text = "(";
    for (size_t k = 0; k < shape.size(); ++k) text += fmt::format("{}{}", k ? ", " : "", shape[k]);
    return text + (shape.size() == 1 ? ",)" : ")");
}

/// Returns the header of an array. `descr` is a type in quotes or a list of fields.
std::string headerOf(const std::string& descr, const std::vector<size_t>& shape) {
    constexpr size_t kBefore = 10, kAlignment = 64; // magic, version and length; the data begins at a multiple of 64
    std::string text = fmt::format("{{'descr': {}, 'fortran_order': False, 'shape': {}, }}", descr, tupleOf(shape));
    text.append((kAlignment - (kBefore + text.size() + 1) % kAlignment) % kAlignment, ' ');
    text += '\n';
    std::string header = "\x93NUMPY";
    header += std::string_view("\1\0", 2);
    appendBytes(header, static_cast<uint16_t>(text.size()));
    return header + text;
}

std::string inQuotes(const std::string& dtype) { return "'" + dtype + "'"; }

/// One array with a row per element: an attribute.
struct Column {
    std::string name, dtype;
    size_t width = 1; ///< Numbers per row.
    std::function<void(size_t row, std::string& bytes)> append;
};

template <class T>
Column scalar(const std::string& name, const std::vector<T>& values) {
    return {name, dtypeOf<T>(), 1, [&values](size_t row, std::string& bytes) { appendBytes(bytes, values[row]); }};
}

template <class T>
Column vector(const std::string& name, const std::vector<T>& x, const std::vector<T>& y, const std::vector<T>& z) {
    return {name, dtypeOf<T>(), 3, [&](size_t row, std::string& bytes) {
                for (const auto* values : {&x, &y, &z}) appendBytes(bytes, (*values)[row]);
            }};
}

/// A column whose values are computed.
template <class Value>
Column computed(const std::string& name, const Value& value) {
    return {name, dtypeOf<decltype(value(size_t{}))>(), 1,
            [value](size_t row, std::string& bytes) { appendBytes(bytes, value(row)); }};
}

void addTrack(std::vector<Column>& columns, const auto& p) {
    if (!p.hasTrack()) return;
    columns.push_back(scalar("f", p.f));
    columns.push_back(scalar("g", p.g));
}

std::vector<Column> columnsOf(const Points& p) {
    std::vector<Column> columns{vector("P", p.x, p.y, p.z)};
    if (p.hasVelocity()) columns.push_back(vector("v", p.vx, p.vy, p.vz));
    columns.push_back(scalar("id", p.id));
    if (p.hasAge()) columns.push_back(scalar("age", p.age));
    if (p.hasLife()) columns.push_back(scalar("life", p.life));
    if (p.hasFade()) columns.push_back(scalar("fade", p.fade));
    addTrack(columns, p);
    return columns;
}

/// The columns of the vertices.
std::vector<Column> columnsOf(const Curves& c) {
    std::vector<Column> columns{vector("P", c.x, c.y, c.z), vector("v", c.vx, c.vy, c.vz)};
    addTrack(columns, c);
    columns.push_back(scalar(alongName(c), c.along));
    return columns;
}

void writeRows(std::ostream& out, size_t rows, const std::vector<Column>& columns) {
    writeChunks(out, rows, [&](size_t begin, size_t end, std::string& bytes) {
        for (size_t row = begin; row < end; ++row)
            for (const Column& column : columns) column.append(row, bytes);
    });
}

/// Writes one array with a field for each column.
void writeStructured(const fs::path& path, size_t rows, const std::vector<Column>& columns,
                     const std::function<bool()>& cancelled) {
    std::string fields;
    for (const Column& column : columns)
        fields += fmt::format("{}('{}', '{}'{})", fields.empty() ? "" : ", ", column.name, column.dtype,
                              column.width > 1 ? fmt::format(", ({},)", column.width) : "");
    const auto write = [&](std::ostream& out) {
        out << headerOf("[" + fields + "]", {rows});
        writeRows(out, rows, columns);
    };
    writeAtomically(path, write, cancelled);
}

/// A .npz while it is written.
class Arrays {
  public:
    Arrays(const fs::path& path, const NumpyOptions& options, std::function<bool()> cancelled)
        : mZip(path, options.deflate, std::move(cancelled)) {}

    void add(const std::string& name, const std::string& dtype, const std::vector<size_t>& shape, double bytes,
             const std::function<void(std::ostream&)>& write) {
        const std::string header = headerOf(inQuotes(dtype), shape);
        mZip.add(name + ".npy", bytes + static_cast<double>(header.size()), [&](std::ostream& out) {
            out << header;
            write(out);
        });
    }

    void add(size_t rows, const Column& column) {
        std::vector<size_t> shape{rows};
        if (column.width > 1) shape.push_back(column.width);
        constexpr double kLargest = 8; // bytes of a number
        add(column.name, column.dtype, shape, kLargest * static_cast<double>(rows * column.width),
            [&](std::ostream& out) { writeRows(out, rows, {column}); });
    }

    template <class T>
    void addNumbers(const std::string& name, const std::vector<size_t>& shape, const std::vector<T>& numbers) {
        std::string bytes;
        for (const T number : numbers) appendBytes(bytes, number);
        add(name, dtypeOf<T>(), shape, static_cast<double>(bytes.size()), [&](std::ostream& out) { out << bytes; });
    }

    void finish(const NumpyOptions& options) {
        if (options.time) {
            addNumbers<double>("frame", {}, {options.time->frame});
            addNumbers<double>("fps", {}, {options.time->fps});
        }
        mZip.close();
    }

  private:
    ZipWriter mZip;
};

/// Returns whether the file is a .npz. Throws ValueError unless it is a .npy or .npz.
bool isArchive(const fs::path& path) {
    const std::string ending = endingOf(path);
    if (ending == ".npz" || ending == ".npy") return ending == ".npz";
    throw ValueError(
        fmt::format("NumPy arrays cannot be written to '{}'; its name must end in .npy or .npz", path.string()));
}

/// Calls `fill` with the arrays of a new .npz.
template <class Fill>
void writeArchive(const fs::path& path, const NumpyOptions& options, const std::function<bool()>& cancelled,
                  const Fill& fill) {
    writeAtomically(path, [&](const fs::path& temporary) {
        Arrays arrays(temporary, options, cancelled);
        fill(arrays);
        arrays.finish(options);
    });
}

// ---- Grids

template <class T>
struct Components {
    using Number = T;
    static constexpr size_t kCount = 1;
};
template <class T>
struct Components<openvdb::math::Vec3<T>> {
    using Number = T;
    static constexpr size_t kCount = 3;
};

/// Calls use(grid) with the grid's own type. Throws ValueError if that type cannot be written.
template <class Use>
void withType(const GridBase& grid, const Use& use) {
    const auto tried = [&]<class GridType>(const GridType*) {
        if (!grid.isType<GridType>()) return false;
        use(static_cast<const GridType&>(grid));
        return true;
    };
    const auto any = [&]<class... GridTypes>(const GridTypes*... types) { return (tried(types) || ...); };
    using namespace openvdb;
    if (!any(static_cast<const FloatGrid*>(nullptr), static_cast<const DoubleGrid*>(nullptr),
             static_cast<const Vec3SGrid*>(nullptr), static_cast<const Vec3DGrid*>(nullptr),
             static_cast<const Int32Grid*>(nullptr), static_cast<const Int64Grid*>(nullptr)))
        throw ValueError(fmt::format("{} is of type {}, which a NumPy file cannot hold; write .vdb", titleOf(grid),
                                     grid.valueType()));
}

/// Makes the array of a grid's values and passes it to add(dtype, shape, bytes, data, box).
template <class Add>
void withValues(const GridBase& base, const Add& add) {
    withType(base, [&]<class GridType>(const GridType& grid) {
        using Value = typename GridType::ValueType;
        using Number = typename Components<Value>::Number;
        const auto dense = denseCopy<openvdb::tools::LayoutZYX>(grid);
        std::vector<size_t> shape;
        shape.reserve(4);
        for (int axis = 0; axis < 3; ++axis) shape.push_back(static_cast<size_t>(dense.bbox().dim()[axis]));
        if (Components<Value>::kCount > 1) shape.push_back(Components<Value>::kCount);
        add(dtypeOf<Number>(), shape, dense.valueCount() * sizeof(Value), reinterpret_cast<const char*>(dense.data()),
            dense.bbox().min());
    });
}

/// Returns the 4 × 4 matrix, row by row, that takes the column [i, j, k, 1] of an array index to world space.
std::vector<double> indexToWorld(const GridBase& grid, const openvdb::Coord& origin) {
    openvdb::Mat4d rows = linearMapOf(grid); // of row vectors
    rows.preTranslate(origin.asVec3d());
    std::vector<double> numbers;
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column) numbers.push_back(rows(column, row));
    return numbers;
}

bool holdsVectors(const GridBase& grid) {
    return grid.isType<openvdb::Vec3SGrid>() || grid.isType<openvdb::Vec3DGrid>();
}

/// Returns the name for a grid whose members have names that are not in use, and adds these to the names.
std::string unusedName(const GridBase& grid, std::set<std::string>& names) {
    std::string wanted = grid.getName().empty() ? "grid" : grid.getName();
    std::replace(wanted.begin(), wanted.end(), '/', '_'); // a member of an archive would be in a folder
    std::string name = wanted;
    const auto members = [&] {
        std::vector<std::string> all{name, name + "_transform"};
        if (holdsVectors(grid)) all.push_back(name + "_staggered");
        return all;
    };
    const auto used = [&](const std::string& member) { return names.contains(member); };
    for (int number = 2; std::ranges::any_of(members(), used); ++number) name = fmt::format("{}{}", wanted, number);
    for (std::string& member : members()) names.insert(std::move(member));
    return name;
}

void addGrid(Arrays& arrays, const GridBase& grid, const std::string& name) {
    withValues(grid, [&](const char* dtype, const std::vector<size_t>& shape, size_t bytes, const char* data,
                         const openvdb::Coord& origin) {
        arrays.add(name, dtype, shape, static_cast<double>(bytes),
                   [&](std::ostream& out) { out.write(data, static_cast<std::streamsize>(bytes)); });
        arrays.addNumbers(name + "_transform", {4, 4}, indexToWorld(grid, origin));
        if (shape.size() == 4) {
            const bool staggered = grid.getGridClass() == openvdb::GRID_STAGGERED;
            arrays.add(name + "_staggered", dtypeOf<bool>(), {}, 1,
                       [&](std::ostream& out) { out.put(static_cast<char>(staggered)); });
        }
    });
}

} // namespace

void writeNumpy(const fs::path& path, const Points& particles, const NumpyOptions& options, const Monitor& monitor) {
    const bool archive = isArchive(path);
    checkArrays(particles);
    requireFinite(particles, "point");
    const std::vector<Column> columns = columnsOf(particles);
    if (!archive) return writeStructured(path, particles.size(), columns, monitor.cancelled);
    writeArchive(path, options, monitor.cancelled, [&](Arrays& arrays) {
        for (const Column& column : columns) arrays.add(particles.size(), column);
    });
}

void writeNumpy(const fs::path& path, const Curves& curves, const NumpyOptions& options, const Monitor& monitor) {
    const bool archive = isArchive(path);
    checkArrays(curves);
    requireFinite(curves, "vertex");
    std::vector<Column> columns = columnsOf(curves);
    if (!archive) {
        const auto owner = owners(curves);
        columns.push_back(computed("curve", [&](size_t v) { return static_cast<int64_t>(owner[v]); }));
        columns.push_back(computed("closed", [&](size_t v) { return curves.closed(owner[v]); }));
        return writeStructured(path, curves.vertices(), columns, monitor.cancelled);
    }
    writeArchive(path, options, monitor.cancelled, [&](Arrays& arrays) {
        for (const Column& column : columns) arrays.add(curves.vertices(), column);
        arrays.add(curves.size() + 1,
                   computed("start", [&](size_t k) { return static_cast<int64_t>(curves.start[k]); }));
        arrays.add(curves.size(), scalar("id", curves.id));
        arrays.add(curves.size(), computed("closed", [&](size_t k) { return curves.closed(k); }));
    });
}

void writeNumpy(const fs::path& path, const std::vector<GridBase::ConstPtr>& grids, const NumpyOptions& options,
                const Monitor& monitor) {
    if (isArchive(path))
        return writeArchive(path, options, monitor.cancelled, [&](Arrays& arrays) {
            std::set<std::string> names{"frame", "fps"};
            for (const GridBase::ConstPtr& grid : grids) addGrid(arrays, *grid, unusedName(*grid, names));
        });
    if (grids.size() != 1) throw ValueError(fmt::format("a .npy holds one grid, not {}; write .npz", grids.size()));
    withValues(*grids.front(), [&](const char* dtype, const std::vector<size_t>& shape, size_t bytes, const char* data,
                                   const openvdb::Coord&) {
        writeAtomically(
            path,
            [&](std::ostream& out) {
                out << headerOf(inQuotes(dtype), shape);
                out.write(data, static_cast<std::streamsize>(bytes));
            },
            monitor.cancelled);
    });
}

} // namespace curlew

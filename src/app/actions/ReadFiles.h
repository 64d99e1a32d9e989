// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Options.h"
#include "curlew/app/run/Context.h"

namespace curlew::app {

/// A file to read: its name as given, and the path of its content as a regular, uncompressed file.
struct SourceFile {
    std::string name;
    std::string path;
};

/// Reads the grids of a .vdb or .nvdb that grids= names, or all. Point grids become points.
void readGrids(Context& c, const Arguments& a, const SourceFile& file);
/// Returns the objects that readGrids() will output, from the file's headers.
std::vector<Object> gridObjects(const Arguments& a, const SourceFile& file);

void readPicture(Context& c, const Arguments& a, const SourceFile& file);

/// Reads a mesh that does not change with time.
void readMeshFile(Context& c, const Arguments& a, const SourceFile& file);

/// Reads a mesh, or points if the file has no faces.
void readPlyFile(Context& c, const Arguments& a, const SourceFile& file);

/// Reads a mesh, or curves if the file has polylines and no faces.
void readObjFile(Context& c, const Arguments& a, const SourceFile& file);
/// Reads points, points of any dimension if the columns are x0, x1, …, or curves if the first column is `curve`.
void readCsvFile(Context& c, const Arguments& a, const SourceFile& file);
/// Returns what an .obj or a .csv contains.
Kind kindOfObj(const std::filesystem::path& path);
Kind kindOfCsv(const std::filesystem::path& path);

/// Reads points with their attributes.
void readPointFile(Context& c, const Arguments& a, const SourceFile& file);

/// Reads a mesh in the pose of an animation clip at the moment.
void readModelFile(Context& c, const Arguments& a, const SourceFile& file);

/// Returns what a .ply contains, from its header.
Kind kindOfPly(const std::filesystem::path& path);

/// Reads the points or the curves of a classic .bgeo.
void readBgeoFile(Context& c, const Arguments& a, const SourceFile& file);
Kind kindOfBgeo(const std::filesystem::path& path);

/// isModel() returns whether files with this extension can have animation clips; modelOptions() returns the options
/// that select a clip.
bool isModel(const std::string& ending);
std::vector<Option> modelOptions();

/// Returns whether the object read from a file with this extension depends on the moment.
bool modelMoves(const Arguments& a, const std::string& name, const std::string& ending);

} // namespace curlew::app

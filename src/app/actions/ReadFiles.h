// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Options.h"
#include "curlew/app/run/Context.h"

namespace curlew::app {

/// A file that is read: its name as it was given, and where its content lies as a regular, uncompressed file.
struct SourceFile {
    std::string name;
    std::string path;
};

/// The grids that grids= names, or all; of points, those.
void readGrids(Context& c, const Arguments& a, const SourceFile& file);
/// What readGrids() gives, from the headers.
std::vector<Object> gridObjects(const Arguments& a, const SourceFile& file);

void readPicture(Context& c, const Arguments& a, const SourceFile& file);

/// A mesh that is the same at every moment.
void readMeshFile(Context& c, const Arguments& a, const SourceFile& file);

/// A mesh, or points if there are no faces.
void readPlyFile(Context& c, const Arguments& a, const SourceFile& file);

/// Points with what they have.
void readPointFile(Context& c, const Arguments& a, const SourceFile& file);

/// A mesh as a clip of the file shows it at the moment.
void readModelFile(Context& c, const Arguments& a, const SourceFile& file);

/// What a .ply holds, from its header.
Kind kindOfPly(const std::filesystem::path& path);

/// The endings of files with clips, and the options that choose from those.
bool isModel(const std::string& ending);
std::vector<Option> modelOptions();

/// Whether what is read from a file with this ending depends on the moment.
bool modelMoves(const Arguments& a, const std::string& name, const std::string& ending);

} // namespace curlew::app

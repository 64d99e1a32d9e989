/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The C interface of Curlew, for C and for languages that can call C. Sessions run programs: a graph as JSON, or the
 * text of a scene, one action per line, as `curlew -config` reads it. Geometry goes in and out as arrays. Fields and
 * flows can be evaluated at positions.
 *
 * Every function that can fail returns a status. curlew_error_message() and the functions next to it describe the
 * error, on the same thread, until the next failure on that thread. Passing NULL where it is not allowed is an ordinary
 * failure. The library prints nothing, handles no signals and never ends the process.
 *
 * Text is UTF-8 and ends with a null character. Positions are in world units, velocities in world units per second.
 *
 * Threads: different sessions may be used by different threads at the same time. One session may be used by one thread
 * at a time; only curlew_cancel() may be called while it runs. Fields and flows are immutable, so any number of threads
 * may evaluate the same one. All computations use all processors. The action `threads` limits the whole process while
 * the program that contains it runs.
 */
#ifndef CURLEW_H
#define CURLEW_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define CURLEW_API
#else
#define CURLEW_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* --- the library ------------------------------------------------------------------------------------------------ */

/** The ABI version of this header. Compare it with curlew_abi_version(): a library with another version must not be
    used with this header. */
#define CURLEW_ABI_VERSION 2

CURLEW_API int32_t curlew_abi_version(void);

/** Returns the version, the commit and the instruction set in use as text for the user: "curlew 0.2.0 (1f3b5c7d90,
    AVX2)". Returns NULL on failure. */
CURLEW_API const char* curlew_version(void);

/** Returns all actions with their options, defaults, ranges and help as JSON: {"actions": [{"name", "group", "summary",
    "inputs", "outputs", "options", "positional", "evaluation", "in_frames", "setting", "varies", "examples"}]}. Returns
    NULL on failure. */
CURLEW_API const char* curlew_registry(void);

/** Sets whether files that could crash the library that reads them (.vdb with points, .nvdb, .exr, .gltf, .glb, .fbx,
    .dae) are read by a separate process, so that a damaged file cannot crash this process: 1 (the default) or 0. The
    setting applies to the whole process. The separate process is the command `curlew`: the one that the environment
    variable CURLEW_READER names, or else the one beside this library or in the bin/ of its installation. If there is
    none, the files are read in this process. Returns 1 if a separate process now reads these files, otherwise 0. */
CURLEW_API int32_t curlew_read_isolated(int32_t on);

/* --- errors ----------------------------------------------------------------------------------------------------- */

typedef int32_t curlew_status;
enum {
    CURLEW_OK = 0,
    CURLEW_VALUE_ERROR = 1,    /**< A value, a name or a program is invalid. */
    CURLEW_FILE_ERROR = 2,     /**< A file cannot be read or written. */
    CURLEW_RESOURCE_ERROR = 3, /**< The work needs more memory (or another resource) than is available. */
    CURLEW_CANCELLED = 4,      /**< A callback or curlew_cancel() has cancelled the run. */
    CURLEW_OUT_OF_MEMORY = 5,  /**< An allocation failed. The session remains usable. */
    CURLEW_INTERNAL_ERROR = 6  /**< An error in the library itself. */
};

/** Returns the status of the last call on this thread that failed; CURLEW_OK if none has failed. */
CURLEW_API curlew_status curlew_error_status(void);

/** Returns the message of the last failure, one line for the user: what is wrong, where, and what to do. Returns "" if
    nothing has failed. */
CURLEW_API const char* curlew_error_message(void);

/** Returns the line of the program's text in which the last failure occurred, counted from 1; 0 if it is not related to
    a line. */
CURLEW_API int32_t curlew_error_line(void);

/** Returns the name of the action that failed; "" if the failure is not related to an action. */
CURLEW_API const char* curlew_error_action(void);

/** Returns the name of the node that failed; "" if the failure is not related to a node. */
CURLEW_API const char* curlew_error_node(void);

/* --- arrays ----------------------------------------------------------------------------------------------------- */

typedef int32_t curlew_type;
enum { CURLEW_FLOAT32 = 0, CURLEW_FLOAT64 = 1, CURLEW_INT32 = 2, CURLEW_INT64 = 3 };

/** An array of `count` items with `components` numbers each. The numbers of an item are contiguous. Consecutive items
    are `stride` bytes apart (0: the size of an item). Numbers need not be aligned. If count is 0, data may be NULL. */
typedef struct curlew_array {
    const void* data;
    int64_t count;
    int64_t stride;
    int32_t components;
    curlew_type type;
} curlew_array;

/** Like curlew_array, but written to. */
typedef struct curlew_buffer {
    void* data;
    int64_t count;
    int64_t stride;
    int32_t components;
    curlew_type type;
} curlew_buffer;

/* --- sessions --------------------------------------------------------------------------------------------------- */

/** A session holds everything that its programs have made: stacks of fields, flows, grids, meshes, points, curves and
    images. */
typedef struct curlew_session curlew_session;

/** Creates an empty session. Release it with curlew_session_release(). */
CURLEW_API curlew_status curlew_session_create(curlew_session** session);

/** Releases the session and sets the pointer to NULL. Does nothing if the pointer is NULL already. Fails without any
    effect while the session runs, including from its own callbacks. */
CURLEW_API curlew_status curlew_session_release(curlew_session** session);

/** Provides a mesh: `read NAME` in programs of this session then reads this mesh instead of a file. Arrays are copied.
    `points` has 3 components, float32 or float64. The mesh is processed as if it were read from a file: points with the
    same position are merged, points without a face are dropped, and polygons with more than 4 vertices are
    triangulated.
    If `sizes` is NULL, `corners` has one item per face with the indices of its 3 or 4 vertices (3 or 4 components,
    int32 or int64). Otherwise `corners` has the vertex indices of all faces one after another (1 component), and
    `sizes` has the number of vertices of each face (1 component). */
CURLEW_API curlew_status curlew_provide_mesh(curlew_session* session, const char* name, const curlew_array* points,
                                             const curlew_array* corners, const curlew_array* sizes);

/** Provides points: `read NAME` in programs of this session then reads these points instead of a file. Arrays are
    copied. `positions` and `velocities` have 3 components, float32 or float64; `ids` has 1 component, int32 or int64.
    If `ids` is NULL, the ids are 0, 1, 2, …. If `velocities` is NULL, the points have no velocities. */
CURLEW_API curlew_status curlew_provide_points(curlew_session* session, const char* name, const curlew_array* positions,
                                               const curlew_array* ids, const curlew_array* velocities);

/** Provides curves, for instance for `rail`: `read NAME` in programs of this session then reads these curves instead of
   a file. Arrays are copied. `positions` has 3 components, float32 or float64; `edges` has 2 components, int32 or
   int64: the indices of two vertices. Edges are joined where exactly two meet at a vertex. A curve runs from the first
   vertex of its edges to the second, if they agree. Vertices without edges are left out. */
CURLEW_API curlew_status curlew_provide_curves(curlew_session* session, const char* name, const curlew_array* positions,
                                               const curlew_array* edges);

/** Evaluates a field at `count` positions, at most 64: writes a value for each, and a gradient with one component for
    each dimension. `positions` and `gradients` have the components of the first position, then of the second, …. Must
    give the same for the same position. Returns 0, or anything else if it failed, which ends the program. Called from
    several threads at a time. */
typedef int (*curlew_field_function)(void* user, int64_t count, const double* positions, double* values,
                                     double* gradients);

/** Provides a field of 1 to 7 dimensions, whose values a function of the caller computes: `read NAME` in programs of
    this session makes it. Its gradients are compared with differences of its values in the cube from -1 to 1; the call
    fails, naming the worst position, if they differ. `user` is passed to the function, which must remain valid while
    the session, or a field or flow from it, exists. `version` identifies the function: results that were computed with
    another version are not used again. */
CURLEW_API curlew_status curlew_provide_field(curlew_session* session, const char* name, int32_t dimension,
                                              curlew_field_function function, void* user, int64_t version);

/** Withdraws what was provided under this name. Fails if there is nothing. */
CURLEW_API curlew_status curlew_withdraw(curlew_session* session, const char* name);

/** Functions that curlew_run() and curlew_run_graph() call. Each may be NULL. None may throw. Except for `frame`, none
    may call functions for the same session. */
typedef struct curlew_callbacks {
    void* user; /**< Passed to every callback. */
    /** Reports the progress of an action, from 0 to 1. Called up to 20 times per second, from any thread, one call at a
        time. Returns nonzero to cancel the program. */
    int (*progress)(void* user, const char* title, double fraction);
    /** Called at the end of each frame of -frames, on the thread that called curlew_run(), while the results of the
        frame are available. May read from the session, but not run or provide anything. Returns nonzero to cancel the
        program. */
    int (*frame)(void* user, int32_t frame);
    /** Receives what the program says (one line) or prints (with its line breaks). Called on the thread that called
        curlew_run(). */
    void (*message)(void* user, const char* text);
} curlew_callbacks;

/** Runs a program, the text of a scene, on the objects in the session. Returns when the program is finished, has failed
    or was cancelled; the objects made until then remain. Messages call the text `name` ("scene" if NULL). `callbacks`
    may be NULL. */
CURLEW_API curlew_status curlew_run(curlew_session* session, const char* text, const char* name,
                                    const curlew_callbacks* callbacks);

/** Runs a graph that replaces all objects in the session. The graph is either JSON ({"curlew": 1, "nodes": [{"name",
    "action", "words", "options", "inputs": {INPUT: [NAME, …]}}], "frames", "moment", "wanted", "effects"}, see
    docs/graph.md) or the text of a scene. Values of the previous run are reused if their node, options and inputs are
    the same, so running an edited graph only evaluates what depends on the edit. Provided geometry is compared by its
    content. */
CURLEW_API curlew_status curlew_run_graph(curlew_session* session, const char* graph, const char* name,
                                          const curlew_callbacks* callbacks);

/** Returns the names of the nodes that the last run evaluated, without those whose values were reused, as a JSON list.
    The text is valid until the next call for the session. */
CURLEW_API curlew_status curlew_evaluated(const curlew_session* session, const char** json);

/** Translates a graph or scene to the given form, "json" or "scene". The text is valid until the next call of this
    function on this thread. Missing files are accepted. */
CURLEW_API curlew_status curlew_translate(const char* graph, const char* name, const char* form, const char** text);

/** Checks whether curlew_run() would start to run the text, or curlew_run_graph() the graph. Finds only errors that can
    be detected before anything is evaluated. Missing files are accepted. */
CURLEW_API curlew_status curlew_check(const char* text, const char* name);

/** Asks the session's running program to stop. May be called from any thread. Does nothing if no program is running. */
CURLEW_API curlew_status curlew_cancel(curlew_session* session);

/* --- results ---------------------------------------------------------------------------------------------------- */

/** The kinds of objects on the stacks. An object is selected by its kind and its age; age 0 is the newest object of the
    kind. Functions that take an age also take the position of a node's result from curlew_find(). */
typedef int32_t curlew_kind;
enum {
    CURLEW_FIELD = 0,
    CURLEW_FLOW = 1,
    CURLEW_GRID = 2,
    CURLEW_MESH = 3,
    CURLEW_POINTS = 4,
    CURLEW_CURVES = 5,
    CURLEW_IMAGE = 6
};

/** Returns the number of objects of a kind on the stacks. */
CURLEW_API curlew_status curlew_count(const curlew_session* session, curlew_kind kind, int64_t* count);

/** Finds the result of a node: "NAME", or "NAME.output" for one of several outputs. The position is valid until the
    session runs again; in a frame callback, until the callback returns. */
CURLEW_API curlew_status curlew_find(const curlew_session* session, const char* name, curlew_kind* kind,
                                     int64_t* position);

/** Describes an object as JSON. The text is valid until the next call for the session.

    fields: {"dimension", "program"}
    flows: {"dimension", "tracks", "divergence_free", "lower", "upper"}; lower and upper are the corners of the domain's
        box.
    grids: {"name", "type", "value_type", "class", "voxel_size", "active_voxels", "level_set", "lower", "upper",
        "transform"}; lower and upper are those of curlew_grid_box(), and transform is the index-to-world matrix (for
        column vectors) by rows, empty if the transform is not linear.
    images: {"width", "height", "channels", "arrays"}
    meshes, points, curves: {"arrays"}

    "arrays" lists the arrays that curlew_read() can copy: {NAME: {"type": "float32", "components", "count"}}. They are:

    points: "position" 3 float64 (4 to 7 in more dimensions); "id" 1 int64; and if the points have them, "velocity" 3
   float32, "age" and "life" 1 float32 (seconds; infinite: the point never dies), "fade" 1 float32 (visibility from 0 to
   1), "track" 2 float64 (f and g), "converged" 1 int32. curves: for each vertex, "position" 3 float64, "velocity" 3
   float32, "along" 1 float64 (distance or time from the seed) and, if the curves have it, "track" 2 float64; "start" 1
   int64, the index of each curve's first vertex, followed by the number of vertices; for each curve, "id" 1 int64,
   "closed" 1 int32 and "length" 1 float64. mesh: "position" 3 float32; "triangles" 3 int32 and "quads" 4 int32, the
   vertex indices of the faces; and if the mesh has them, "normal" 3 float32 and "uv" 2 float32 for each vertex. image:
   "pixels" float32, one component per channel, rows from top to bottom; NaN marks pixels without a value. */
CURLEW_API curlew_status curlew_describe(const curlew_session* session, curlew_kind kind, int64_t age,
                                         const char** json);

/** Copies an array of an object to a buffer, which must have the same number of items and components. Floats can be
    read as float32 or float64, integers as int32 or int64. Fails if an integer does not fit the buffer's type. */
CURLEW_API curlew_status curlew_read(const curlew_session* session, curlew_kind kind, int64_t age, const char* array,
                                     const curlew_buffer* buffer);

/** Returns the actions' measurements as JSON, by action. The text is valid until the next call for the session. */
CURLEW_API curlew_status curlew_report(const curlew_session* session, const char** json);

/* --- grids ------------------------------------------------------------------------------------------------------ */

/** Returns the bounding box of the active voxels, in index space; `upper` is exclusive. An empty grid has an empty box
    at the origin. */
CURLEW_API curlew_status curlew_grid_box(const curlew_session* session, int64_t age, int64_t lower[3],
                                         int64_t upper[3]);

/** Copies the values in a box of voxels to a buffer with one item per voxel, x slowest and z fastest. `upper` is
    exclusive. The buffer has 3 components for vector grids, otherwise 1; float32 or float64 for float, double and
    vector grids, int32 or int64 for integer grids. */
CURLEW_API curlew_status curlew_grid_read(const curlew_session* session, int64_t age, const int64_t lower[3],
                                          const int64_t upper[3], const curlew_buffer* buffer);

/** Returns the number of leaf nodes of a grid: blocks of 8 x 8 x 8 voxels. */
CURLEW_API curlew_status curlew_grid_leaves(const curlew_session* session, int64_t age, int64_t* count);

/** Returns a leaf node without copying: the index of its first voxel, its 512 values (of the grid's "value_type", x
    slowest and z fastest; 3 numbers each for vectors), and 512 bits that mark the active values. The pointers are valid
    until the session runs again or is released; in a frame callback, until the callback returns. */
CURLEW_API curlew_status curlew_grid_leaf(const curlew_session* session, int64_t age, int64_t leaf, int64_t origin[3],
                                          const void** values, const uint64_t** active);

/* --- fields and flows ------------------------------------------------------------------------------------------- */

typedef struct curlew_field curlew_field;
typedef struct curlew_flow curlew_flow;

/** Returns one of the session's fields. It remains valid after the session is released. Release it with
    curlew_field_release(). */
CURLEW_API curlew_status curlew_session_field(const curlew_session* session, int64_t age, curlew_field** field);

/** Returns one of the session's flows. It remains valid after the session is released. Release it with
    curlew_flow_release(). A flow that changes with time is returned as it is at the end of the program. */
CURLEW_API curlew_status curlew_session_flow(const curlew_session* session, int64_t age, curlew_flow** flow);

/** Releases the field or flow and sets the pointer to NULL. Must not be called while the object is being evaluated. */
CURLEW_API void curlew_field_release(curlew_field** field);
CURLEW_API void curlew_flow_release(curlew_flow** flow);

/** Returns the dimension, 1 to 7; 0 if the pointer is NULL. */
CURLEW_API int32_t curlew_field_dimension(const curlew_field* field);
CURLEW_API int32_t curlew_flow_dimension(const curlew_flow* flow);

/** Evaluates the field and its gradient at positions. `values` and `gradients` may be NULL. Positions have as many
    components as the field has dimensions, or 3 if the field has fewer (it is constant along the other axes). Values
    have 1 component; gradients have as many as positions. The computation uses float32 if all given buffers are
    float32, otherwise float64. Positions always keep their full precision. At positions that are not finite, all
    results are NaN. */
CURLEW_API curlew_status curlew_field_evaluate(const curlew_field* field, const curlew_array* positions,
                                               const curlew_buffer* values, const curlew_buffer* gradients);

/** Evaluates the flow's velocity and its potentials at positions, under the same rules as curlew_field_evaluate().
    `velocities` and `potentials` may be NULL. In n dimensions there are n - 1 potentials (f and g in 3D); asking for
    them fails if the flow has no tracks. A 2D flow at 3D positions has two potentials. */
CURLEW_API curlew_status curlew_flow_evaluate(const curlew_flow* flow, const curlew_array* positions,
                                              const curlew_buffer* velocities, const curlew_buffer* potentials);

#ifdef __cplusplus
}
#endif

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* The most common use, with a library that is loaded at run time (argv[1]): passes in a mesh as arrays, and reads back
   a flow around it, particles that follow the flow, and a velocity grid. */
#include "Check.h"
#include "curlew.h"

#include <dlfcn.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef void (*function)(void);

static void* library;

static function loaded(const char* name) {
    function found = NULL;
    void* symbol = dlsym(library, name);
    if (!symbol) {
        fprintf(stderr, "there is no %s\n", name);
        exit(1);
    }
    memcpy(&found, &symbol, sizeof found); /* C99 has no cast from an object to a function pointer */
    return found;
}

#define LOAD(type, name, arguments)           \
    typedef type(*name##_function) arguments; \
    static name##_function name##_

LOAD(const char*, error_message, (void));
LOAD(curlew_status, session_create, (curlew_session**));
LOAD(curlew_status, session_release, (curlew_session**));
LOAD(curlew_status, provide_mesh,
     (curlew_session*, const char*, const curlew_array*, const curlew_array*, const curlew_array*));
LOAD(curlew_status, run, (curlew_session*, const char*, const char*, const curlew_callbacks*));
LOAD(curlew_status, run_graph, (curlew_session*, const char*, const char*, const curlew_callbacks*));
LOAD(curlew_status, evaluated, (const curlew_session*, const char**));
LOAD(curlew_status, translate, (const char*, const char*, const char*, const char**));
LOAD(curlew_status, find, (const curlew_session*, const char*, curlew_kind*, int64_t*));
LOAD(curlew_status, grid_leaves, (const curlew_session*, int64_t, int64_t*));
LOAD(curlew_status, grid_leaf, (const curlew_session*, int64_t, int64_t, int64_t*, const void**, const uint64_t**));
LOAD(curlew_status, count, (const curlew_session*, curlew_kind, int64_t*));
LOAD(curlew_status, describe, (const curlew_session*, curlew_kind, int64_t, const char**));
LOAD(curlew_status, read, (const curlew_session*, curlew_kind, int64_t, const char*, const curlew_buffer*));
LOAD(curlew_status, report, (const curlew_session*, const char**));
LOAD(curlew_status, session_flow, (const curlew_session*, int64_t, curlew_flow**));
LOAD(void, flow_release, (curlew_flow**));
LOAD(curlew_status, flow_evaluate,
     (const curlew_flow*, const curlew_array*, const curlew_buffer*, const curlew_buffer*));

#define GET(name) name##_ = (name##_function)loaded("curlew_" #name)

/* A sphere of radius 0.5: rings of quads, and triangles at the poles, in one list of faces with different sizes. */
enum { kRings = 24, kSides = 48, kPoints = 2 + (kRings - 1) * kSides };
static float points[kPoints][3];
static int32_t corners[kRings * kSides * 4];
static int32_t sizes[kRings * kSides];

static int32_t vertex(int ring, int side) {
    if (ring == 0) return 0;
    if (ring == kRings) return kPoints - 1;
    return 1 + (ring - 1) * kSides + side % kSides;
}

static int64_t makeSphere(int64_t* faces) {
    const double pi = acos(-1.0);
    int64_t used = 0;
    *faces = 0;
    for (int ring = 0; ring <= kRings; ++ring)
        for (int side = 0; side < kSides; ++side) {
            const double polar = pi * ring / kRings, around = 2 * pi * side / kSides;
            float* p = points[vertex(ring, side)];
            p[0] = (float)(0.5 * sin(polar) * cos(around));
            p[1] = (float)(0.5 * cos(polar));
            p[2] = (float)(0.5 * sin(polar) * sin(around));
        }
    for (int ring = 0; ring < kRings; ++ring)
        for (int side = 0; side < kSides; ++side) {
            const int64_t before = used;
            corners[used++] = vertex(ring, side);
            if (ring > 0) corners[used++] = vertex(ring, side + 1);
            if (ring < kRings - 1) corners[used++] = vertex(ring + 1, side + 1);
            corners[used++] = vertex(ring + 1, side);
            sizes[(*faces)++] = (int32_t)(used - before);
        }
    return used;
}

static int progressCalls = 0;
static int progress(void* user, const char* title, double fraction) {
    ++*(int*)user;
    CHECK(title != NULL && fraction >= 0 && fraction <= 1);
    return 0;
}

static char said[4096];
static void message(void* user, const char* text) {
    (void)user;
    strncat(said, text, sizeof said - strlen(said) - 1);
}

static void mustRun(curlew_session* session, const char* text) {
    const curlew_callbacks callbacks = {&progressCalls, progress, NULL, message};
    if (run_(session, text, "job", &callbacks) != CURLEW_OK) {
        fprintf(stderr, "%s\n", error_message_());
        exit(1);
    }
}

/* A particle that stores its position in a larger struct. */
typedef struct particle {
    char tag;
    float position[3];
    double velocity[3];
    int32_t id;
} particle;

static double lengthOf(const double* v) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

static void checkPoints(const curlew_session* session) {
    enum { kCount = 2000 };
    static particle particles[kCount];
    static double velocities[kCount][3];
    const curlew_buffer position = {particles[0].position, kCount, sizeof(particle), 3, CURLEW_FLOAT32};
    const curlew_buffer id = {&particles[0].id, kCount, sizeof(particle), 1, CURLEW_INT32};
    const curlew_buffer velocity = {particles[0].velocity, kCount, sizeof(particle), 3, CURLEW_FLOAT64};
    const curlew_buffer packed = {velocities, kCount, 0, 3, CURLEW_FLOAT64};
    int inside = 0, sameIds = 0;
    CHECK(read_(session, CURLEW_POINTS, 0, "position", &position) == CURLEW_OK);
    CHECK(read_(session, CURLEW_POINTS, 0, "id", &id) == CURLEW_OK);
    CHECK(read_(session, CURLEW_POINTS, 0, "velocity", &velocity) == CURLEW_OK);
    CHECK(read_(session, CURLEW_POINTS, 0, "velocity", &packed) == CURLEW_OK);
    for (int k = 0; k < kCount; ++k) {
        double p[3];
        for (int axis = 0; axis < 3; ++axis) p[axis] = particles[k].position[axis];
        inside += lengthOf(p) < 0.49; /* the polyhedron lies slightly inside the sphere */
        sameIds += particles[k].id == k;
        CHECK(memcmp(particles[k].velocity, velocities[k], sizeof velocities[k]) == 0);
    }
    CHECK(inside == 0);
    CHECK(sameIds == kCount);
}

/* Evaluates the flow at the particles: it equals their velocity. */
static void checkFlow(const curlew_session* session) {
    enum { kCount = 2000 };
    static double positions[kCount][3], velocities[kCount][3], velocityThen[kCount][3], potentials[kCount][2];
    static float asFloat[kCount][3];
    const curlew_buffer readPositions = {positions, kCount, 0, 3, CURLEW_FLOAT64};
    const curlew_buffer readVelocities = {velocityThen, kCount, 0, 3, CURLEW_FLOAT64};
    const curlew_array at = {positions, kCount, 0, 3, CURLEW_FLOAT64};
    const curlew_buffer v = {velocities, kCount, 0, 3, CURLEW_FLOAT64};
    const curlew_buffer fg = {potentials, kCount, 0, 2, CURLEW_FLOAT64};
    const curlew_buffer single = {asFloat, kCount, 0, 3, CURLEW_FLOAT32};
    double largest = 0, differs = 0, differsSingle = 0;
    curlew_flow* flow = NULL;
    CHECK(read_(session, CURLEW_POINTS, 0, "position", &readPositions) == CURLEW_OK);
    CHECK(read_(session, CURLEW_POINTS, 0, "velocity", &readVelocities) == CURLEW_OK);
    CHECK(session_flow_(session, 0, &flow) == CURLEW_OK);
    CHECK(flow_evaluate_(flow, &at, &v, &fg) == CURLEW_OK);
    CHECK(flow_evaluate_(flow, &at, &single, NULL) == CURLEW_OK);
    for (int k = 0; k < kCount; ++k) {
        double difference[3], differenceSingle[3];
        for (int axis = 0; axis < 3; ++axis) {
            difference[axis] = velocities[k][axis] - velocityThen[k][axis];
            differenceSingle[axis] = velocities[k][axis] - asFloat[k][axis];
        }
        largest = fmax(largest, lengthOf(velocities[k]));
        differs = fmax(differs, lengthOf(difference));
        differsSingle = fmax(differsSingle, lengthOf(differenceSingle));
    }
    CHECK(largest > 0.5);
    CHECK(differs < 1e-5 * largest);       /* particles store their velocity as float */
    CHECK(differsSingle < 1e-3 * largest); /* the cross product of gradients suffers from cancellation */
    flow_release_(&flow);
    CHECK(flow == NULL);
}

/* Runs a graph such as hosts pass in. `frequency` is that of the first noise. */
static void runGraph(curlew_session* session, const char* frequency) {
    char graph[4000];
    snprintf(graph, sizeof graph,
             "{\"curlew\": 1, \"nodes\": ["
             "{\"name\": \"ball\", \"action\": \"read\", \"words\": [\"no such file.ply\"]},"
             "{\"name\": \"wall\", \"action\": \"mesh2ls\", \"options\": {\"voxel\": 0.05}, \"inputs\": {\"mesh\": "
             "[\"ball\"]}},"
             "{\"name\": \"f\", \"action\": \"noise\", \"options\": {\"frequency\": %s}},"
             "{\"name\": \"n\", \"action\": \"noise\", \"options\": {\"seed\": 2}},"
             "{\"name\": \"g\", \"action\": \"bound\", \"options\": {\"width\": 0.15, \"side\": \"outside\"},"
             " \"inputs\": {\"noise\": [\"n\"], \"wall\": [\"wall\"]}},"
             "{\"name\": \"wind\", \"action\": \"dfvn\", \"options\": {\"speed\": 1}, \"inputs\": {\"f\": [\"f\"], "
             "\"g\": [\"g\"]}},"
             "{\"name\": \"smoke\", \"action\": \"velocity\", \"options\": {\"voxel\": 0.1, \"density\": true},"
             " \"inputs\": {\"flow\": [\"wind\"]}}]}",
             frequency);
    if (run_graph_(session, graph, "graph", NULL) != CURLEW_OK) {
        fprintf(stderr, "%s\n", error_message_());
        exit(1);
    }
}

/* After an edit, only the nodes that depend on it are evaluated. Results are found by the names of nodes. */
static void checkGraph(curlew_session* session) {
    const char* json = NULL;
    const void* values = NULL;
    const uint64_t* active = NULL;
    curlew_kind kind = -1;
    int64_t position = -1, leaves = 0, origin[3] = {1, 1, 1}, set = 0;
    runGraph(session, "2");
    CHECK(evaluated_(session, &json) == CURLEW_OK && strstr(json, "\"wall\"") && strstr(json, "\"smoke\""));
    runGraph(session, "2");
    CHECK(evaluated_(session, &json) == CURLEW_OK && strcmp(json, "[]") == 0);
    runGraph(session, "3");
    CHECK(evaluated_(session, &json) == CURLEW_OK && strcmp(json, "[\"f\",\"wind\",\"smoke\"]") == 0);
    CHECK(find_(session, "wind", &kind, &position) == CURLEW_OK && kind == CURLEW_FLOW);
    CHECK(find_(session, "smoke.density", &kind, &position) == CURLEW_OK && kind == CURLEW_GRID);
    CHECK(describe_(session, kind, position, &json) == CURLEW_OK && strstr(json, "\"name\":\"density\""));
    CHECK(grid_leaves_(session, position, &leaves) == CURLEW_OK && leaves > 0);
    for (int64_t leaf = 0; leaf < leaves; ++leaf) {
        CHECK(grid_leaf_(session, position, leaf, origin, &values, &active) == CURLEW_OK);
        CHECK(values != NULL && active != NULL && origin[0] % 8 == 0 && origin[1] % 8 == 0 && origin[2] % 8 == 0);
        for (int word = 0; word < 8; ++word)
            for (int bit = 0; bit < 64; ++bit) set += (int64_t)(active[word] >> bit & 1);
    }
    CHECK(set > 1000);
    CHECK(translate_("noise\nslice width=8\n", NULL, "json", &json) == CURLEW_OK && strstr(json, "\"nodes\""));
}

int main(int argc, char** argv) {
    int64_t faces = 0, number = 0;
    const char* json = NULL;
    curlew_session* session = NULL;
    if (argc != 2 || !(library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL))) {
        fprintf(stderr, "usage: job LIBRARY: %s\n", argc == 2 ? dlerror() : "");
        return 1;
    }
    GET(error_message);
    GET(session_create);
    GET(session_release);
    GET(provide_mesh);
    GET(run);
    GET(run_graph);
    GET(evaluated);
    GET(translate);
    GET(find);
    GET(grid_leaves);
    GET(grid_leaf);
    GET(count);
    GET(describe);
    GET(read);
    GET(report);
    GET(session_flow);
    GET(flow_release);
    GET(flow_evaluate);

    CHECK(session_create_(&session) == CURLEW_OK);
    {
        const int64_t used = makeSphere(&faces);
        const curlew_array p = {points, kPoints, 0, 3, CURLEW_FLOAT32}, c = {corners, used, 0, 1, CURLEW_INT32},
                           n = {sizes, faces, 0, 1, CURLEW_INT32};
        CHECK(provide_mesh_(session, "no such file.ply", &p, &c, &n) == CURLEW_OK);
    }
    mustRun(session,
            "read 'no such file.ply'\n"
            "mesh2ls voxel=0.02\n"
            "noise frequency=2 seed=1\n"
            "noise frequency=2 seed=2\n"
            "bound layer=0.15 side=outside\n"
            "dfvn speed=1\n"
            "velocity voxel=0.1 density=1\n"
            "scatter count=2000\n"
            "advect duration=0.5 steps=10\n"
            "check samples=1000 strict=1\n"
            "print\n");
    CHECK(progressCalls > 0);
    CHECK(strstr(said, "with tracks in ") != NULL); /* the output of -print */

    CHECK(count_(session, CURLEW_POINTS, &number) == CURLEW_OK && number == 1);
    CHECK(count_(session, CURLEW_GRID, &number) == CURLEW_OK && number == 3);
    CHECK(count_(session, CURLEW_MESH, &number) == CURLEW_OK && number == 0);
    CHECK(describe_(session, CURLEW_GRID, 0, &json) == CURLEW_OK);
    CHECK(strstr(json, "\"name\":\"vel\"") && strstr(json, "\"voxel_size\":[0.1,0.1,0.1]"));
    CHECK(report_(session, &json) == CURLEW_OK && strstr(json, "\"outside\":0"));
    checkPoints(session);
    checkFlow(session);
    checkGraph(session);
    session_release_(&session);
    dlclose(library);
    return failures == 0 ? 0 : 1;
}

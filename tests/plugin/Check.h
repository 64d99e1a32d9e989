// SPDX-License-Identifier: Apache-2.0
/* Assertions of the C programs. */
#ifndef CURLEW_TESTS_CHECK_H
#define CURLEW_TESTS_CHECK_H

#include <stdio.h>

static int failures = 0;

#define CHECK(condition)                                                              \
    do {                                                                              \
        if (!(condition)) {                                                           \
            ++failures;                                                               \
            fprintf(stderr, "%s:%d: %s is not so\n", __FILE__, __LINE__, #condition); \
        }                                                                             \
    } while (0)

#endif

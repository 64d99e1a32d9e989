/* SPDX-License-Identifier: Apache-2.0 */
/* The header compiles as C99 without other headers. */
#include "curlew.h"

int main(void) {
    curlew_session* session = NULL;
    int good = curlew_abi_version() == CURLEW_ABI_VERSION && curlew_version() != NULL && curlew_registry() != NULL;
    good = good && curlew_session_create(&session) == CURLEW_OK && session != NULL;
    curlew_session_release(&session);
    good = good && session == NULL;
    curlew_session_release(&session);
    return good ? 0 : 1;
}

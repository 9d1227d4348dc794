#!/bin/sh
# No header defines a name outside sss_X_ and SSS_X_, keeps state, or calls what a library must not; and each kind of
# leak, put into a copy of a header, is found.
cd "$(dirname "$0")/../.." || exit 1
. tests/compile/jobs.sh

for header in $headers; do
    job "$header: only its own names, no state, no printing or exiting" "sh tests/compile/names.sh $header"
done

# One copy with a leak of every kind at its end; the report must tell each.
mkdir "$work/mutated"
cp sss_dipole.h "$work/mutated/sss_dipole.h"
mutate() # what it is, the line put at the end of the header, what the report must say
{
    printf '%s\n' "$2" >>"$work/mutated/sss_dipole.h"
    job "found when put in: $1" "grep -e '$3' '$work/report'"
}
mutate "a macro" '#define SSS_DIPOL_PI 3' 'leak: macro SSS_DIPOL_PI$'
mutate "a typedef" 'typedef int sss_number;' 'leak: TypedefDecl sss_number$'
mutate "an enumerator" 'enum sss_dipole_e { SSS_WRONG };' 'leak: EnumConstantDecl SSS_WRONG$'
mutate "a struct" 'struct wrong { int i; };' 'leak: tag wrong$'
mutate "a public function" 'void wrong_public(void); void wrong_public(void) {}' 'leak: public wrong_public$'
mutate "a static function" 'static inline int wrong_static(void) { return 1; }' 'leak: FunctionDecl wrong_static$'
mutate "a private function that is not static" 'void sss_dipole__f(void); void sss_dipole__f(void) {}' \
    'leak: private-but-public sss_dipole__f$'
mutate "state in a static variable" \
    'int sss_dipole_f(void); int sss_dipole_f(void) { static int calls; return ++calls; }' 'leak: writable calls'
mutate "state at file scope" 'int sss_dipole_count = 3;' 'leak: writable sss_dipole_count$'
mutate "printing" '#include <stdio.h>
void sss_dipole_g(void); void sss_dipole_g(void) { fprintf(stderr, "%d", 1); }' 'leak: calls fprintf$'
mutate "aborting" '#include <stdlib.h>
void sss_dipole_h(void); void sss_dipole_h(void) { abort(); }' 'leak: calls abort$'
sh tests/compile/names.sh sss_dipole.h "$work/mutated" >"$work/report"
status=$?
job "a header that leaks is refused" "cat '$work/report'; [ $status != 0 ]"

jobs_end

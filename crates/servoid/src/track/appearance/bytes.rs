//! Little-endian numbers, written one after another and read back with every check.

use super::Flaw;

/// Largest difference from 1 of the length of a unit vector or a unit quaternion.
const UNIT: f32 = 1e-3;

/// Writes numbers.
#[derive(Debug, Default)]
pub(super) struct Writer(pub(super) Vec<u8>);

impl Writer {
    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        self.0.extend(bytes);
    }

    pub(super) fn flags(&mut self, flags: &[bool]) {
        self.0.push(flags.iter().enumerate().fold(0, |all, (at, &is)| all | u8::from(is) << at));
    }

    pub(super) fn count(&mut self, count: usize) {
        self.whole(u32::try_from(count).unwrap_or(u32::MAX));
    }

    pub(super) fn whole(&mut self, number: u32) {
        self.0.extend(number.to_le_bytes());
    }

    pub(super) fn numbers(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|number| self.0.extend(number.to_le_bytes()));
    }

    pub(super) fn singles(&mut self, numbers: &[f32]) {
        numbers.iter().for_each(|number| self.0.extend(number.to_le_bytes()));
    }

    pub(super) fn words(&mut self, numbers: &[u16]) {
        numbers.iter().for_each(|number| self.0.extend(number.to_le_bytes()));
    }

    pub(super) fn shorts(&mut self, numbers: &[i16]) {
        numbers.iter().for_each(|number| self.0.extend(number.to_le_bytes()));
    }
}

/// The bytes that are not read yet.
pub(super) struct Reader<'a>(pub(super) &'a [u8]);

impl Reader<'_> {
    pub(super) fn take<const N: usize>(&mut self) -> Result<[u8; N], Flaw> {
        let (taken, rest) = self.0.split_first_chunk::<N>().ok_or(Flaw::CutShort)?;
        self.0 = rest;
        Ok(*taken)
    }

    /// Reads up to eight flags; the other bits of their byte must be zero.
    pub(super) fn flags<const N: usize>(&mut self) -> Result<[bool; N], Flaw> {
        let [byte] = self.take::<1>()?;
        if u32::from(byte) >> N != 0 {
            return Err(Flaw::Flags);
        }
        Ok(std::array::from_fn(|at| byte >> at & 1 == 1))
    }

    /// Reads how many `what` follow, each of `least` bytes or more.
    pub(super) fn count(
        &mut self,
        what: &'static str,
        (most, least): (usize, usize),
    ) -> Result<usize, Flaw> {
        let given = self.whole()? as usize;
        if given > most {
            return Err(Flaw::TooMany { what, given, most });
        }
        if given * least > self.0.len() {
            return Err(Flaw::CutShort);
        }
        Ok(given)
    }

    pub(super) fn whole(&mut self) -> Result<u32, Flaw> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    pub(super) fn number(&mut self) -> Result<f64, Flaw> {
        let number = f64::from_le_bytes(self.take()?);
        if number.is_finite() { Ok(number) } else { Err(Flaw::NotFinite) }
    }

    pub(super) fn single(&mut self) -> Result<f32, Flaw> {
        let number = f32::from_le_bytes(self.take()?);
        if number.is_finite() { Ok(number) } else { Err(Flaw::NotFinite) }
    }

    pub(super) fn numbers<const N: usize>(&mut self) -> Result<[f64; N], Flaw> {
        let mut out = [0.0; N];
        for number in &mut out {
            *number = self.number()?;
        }
        Ok(out)
    }

    pub(super) fn singles<const N: usize>(&mut self) -> Result<[f32; N], Flaw> {
        let mut out = [0.0; N];
        for number in &mut out {
            *number = self.single()?;
        }
        Ok(out)
    }

    pub(super) fn words<const N: usize>(&mut self) -> Result<[u16; N], Flaw> {
        let mut out = [0; N];
        for number in &mut out {
            *number = u16::from_le_bytes(self.take()?);
        }
        Ok(out)
    }

    pub(super) fn shorts<const N: usize>(&mut self) -> Result<[i16; N], Flaw> {
        let mut out = [0; N];
        for number in &mut out {
            *number = i16::from_le_bytes(self.take()?);
        }
        Ok(out)
    }

    /// Reads a vector, or a quaternion, of length 1.
    pub(super) fn unit<const N: usize>(&mut self, what: &'static str) -> Result<[f32; N], Flaw> {
        let out = self.singles()?;
        let square: f32 = out.iter().map(|x| x * x).sum();
        // Squares may be too large for a number: those are not units, either.
        if (square.sqrt() - 1.0).abs() <= UNIT { Ok(out) } else { Err(Flaw::NotUnit(what)) }
    }

    /// Reads a number that is not negative and at most `most`.
    pub(super) fn upto(&mut self, what: &'static str, most: f32) -> Result<f32, Flaw> {
        let out = self.single()?;
        if (0.0..=most).contains(&out) { Ok(out) } else { Err(Flaw::Outside(what)) }
    }
}

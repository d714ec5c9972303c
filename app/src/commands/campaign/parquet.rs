//! Rows as a Parquet file: for those who read hundreds of thousands of them.

use std::sync::Arc;

use parquet::{
    basic::{LogicalType, Repetition, Type as Physical},
    data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type},
    errors::ParquetError,
    file::{
        properties::WriterProperties,
        writer::{SerializedFileWriter, SerializedRowGroupWriter},
    },
    schema::types::Type,
};
use serde_json::Value;

use super::table::Rows;
use crate::failure::Failure;

/// The rows, every column optional: whole numbers, numbers, truth, or else words.
pub(crate) fn parquet(rows: &Rows) -> Result<Vec<u8>, Failure> {
    write(rows).map_err(|e| Failure::Internal(format!("cannot make Parquet: {e}")))
}

fn write(rows: &Rows) -> Result<Vec<u8>, ParquetError> {
    let kinds: Vec<Kind> = (0..rows.columns.len()).map(|at| Kind::of(rows, at)).collect();
    let fields = rows.columns.iter().zip(&kinds).map(|(name, kind)| kind.field(name));
    let schema = Type::group_type_builder("results")
        .with_fields(fields.collect::<Result<Vec<_>, _>>()?)
        .build()?;
    let properties = WriterProperties::builder().set_created_by("Intrados".into()).build();
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for (at, kind) in kinds.iter().enumerate() {
        let cells: Vec<Option<&Value>> =
            rows.rows.iter().map(|row| row.get(at).filter(|value| !value.is_null())).collect();
        kind.column(&mut group, &cells)?;
    }
    group.close()?;
    writer.into_inner()
}

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Whole,
    Number,
    Truth,
    Words,
}

impl Kind {
    fn of(rows: &Rows, at: usize) -> Self {
        let all = |is: fn(&Value) -> bool| {
            rows.rows.iter().filter_map(|row| row.get(at)).all(|v| v.is_null() || is(v))
        };
        match () {
            () if all(Value::is_i64) => Self::Whole,
            () if all(Value::is_number) => Self::Number,
            () if all(Value::is_boolean) => Self::Truth,
            () => Self::Words,
        }
    }

    fn field(self, name: &str) -> Result<Arc<Type>, ParquetError> {
        let (physical, logical) = match self {
            Self::Whole => (Physical::INT64, None),
            Self::Number => (Physical::DOUBLE, None),
            Self::Truth => (Physical::BOOLEAN, None),
            Self::Words => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let field = Type::primitive_type_builder(name, physical)
            .with_repetition(Repetition::OPTIONAL)
            .with_logical_type(logical)
            .build()?;
        Ok(Arc::new(field))
    }

    fn column(
        self,
        group: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
        cells: &[Option<&Value>],
    ) -> Result<(), ParquetError> {
        let there: Vec<i16> = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
        let some = || cells.iter().flatten();
        let Some(mut column) = group.next_column()? else {
            return Err(ParquetError::General("a column is missing".into()));
        };
        match self {
            Self::Whole => {
                let values: Vec<i64> = some().filter_map(|v| v.as_i64()).collect();
                column.typed::<Int64Type>().write_batch(&values, Some(&there), None)?;
            }
            Self::Number => {
                let values: Vec<f64> = some().filter_map(|v| v.as_f64()).collect();
                column.typed::<DoubleType>().write_batch(&values, Some(&there), None)?;
            }
            Self::Truth => {
                let values: Vec<bool> = some().filter_map(|v| v.as_bool()).collect();
                column.typed::<BoolType>().write_batch(&values, Some(&there), None)?;
            }
            Self::Words => {
                let text = |v: &&Value| ByteArray::from(super::table::cell(v).into_bytes());
                let values: Vec<ByteArray> = some().map(text).collect();
                column.typed::<ByteArrayType>().write_batch(&values, Some(&there), None)?;
            }
        }
        column.close()
    }
}

#[cfg(test)]
mod tests {
    use parquet::{
        file::reader::{FileReader, SerializedFileReader},
        record::Field,
    };
    use serde_json::json;

    use super::*;

    /// Read back by the same library; pandas reads it too (docs/results.md).
    #[test]
    fn what_is_written_is_read() {
        let rows = Rows {
            columns: ["n", "x", "ok", "word"].map(String::from).into(),
            rows: vec![
                vec![json!(1), json!(0.1), json!(true), json!("bridge")],
                vec![Value::Null, json!(2), Value::Null, Value::Null],
            ],
        };
        let bytes = parquet(&rows).unwrap();
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        let reader = SerializedFileReader::new(file.reopen().unwrap()).unwrap();
        let read: Vec<Vec<Field>> = reader
            .get_row_iter(None)
            .unwrap()
            .map(|row| row.unwrap().get_column_iter().map(|(_, f)| f.clone()).collect())
            .collect();
        assert_eq!(
            read[0],
            [Field::Long(1), Field::Double(0.1), Field::Bool(true), Field::Str("bridge".into())]
        );
        assert_eq!(read[1], [Field::Null, Field::Double(2.0), Field::Null, Field::Null]);
    }
}
